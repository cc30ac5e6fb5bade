// The WebGL context: asked for by the page's first script, because a browser takes longest for that.

const options = { alpha: true, depth: true, stencil: false, powerPreference: "low-power" };

/** {gl, software}: the canvas's context, and whether the processor has to draw. Smooth edges cost a processor too much. */
export function contextOf(canvas) {
  if (canvas.drawnBy) return canvas.drawnBy;
  const get = (more) => canvas.getContext("webgl2", { ...options, ...more }) ?? canvas.getContext("webgl", { ...options, ...more });
  let gl = get({ antialias: true, failIfMajorPerformanceCaveat: true });
  let software = !gl;
  gl ??= get({ antialias: false });
  const named = gl?.getExtension("WEBGL_debug_renderer_info");
  if (named && /swiftshader|llvmpipe|softpipe|software/i.test(gl.getParameter(named.UNMASKED_RENDERER_WEBGL))) software = true;
  canvas.drawnBy = { gl, software };
  return canvas.drawnBy;
}

contextOf(document.getElementById("canvas"));
