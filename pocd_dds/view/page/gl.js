// The WebGL context: asked for by one of the page's first scripts, because a browser takes longest for that.

const options = { alpha: true, depth: true, stencil: false, powerPreference: "low-power" };
const get = (canvas, more) => canvas.getContext("webgl2", { ...options, ...more }) ?? canvas.getContext("webgl", { ...options, ...more });
let made = null;

/**
 * {canvas, gl, software}: the context of the page's canvas, and whether the processor has to draw. Smooth edges cost a processor too much;
 * who draws is known of a context only, which cannot be changed: a canvas with smooth edges takes the place of the first one.
 */
export function context() {
  if (made) return made;
  const canvas = document.getElementById("canvas");
  made = { canvas, gl: get(canvas, { antialias: false }), software: true };
  const named = made.gl?.getExtension("WEBGL_debug_renderer_info");
  if (!made.gl || (named && /swiftshader|llvmpipe|softpipe|software/i.test(made.gl.getParameter(named.UNMASKED_RENDERER_WEBGL)))) return made;
  const smooth = canvas.cloneNode();
  const gl = get(smooth, { antialias: true, failIfMajorPerformanceCaveat: true });
  if (!gl) return made;
  canvas.replaceWith(smooth);
  made.gl.getExtension("WEBGL_lose_context")?.loseContext();
  made = { canvas: smooth, gl, software: false };
  return made;
}

if (document.getElementById("canvas")) context();  // or the document is still being read: later
