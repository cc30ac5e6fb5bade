// The link's first connection, made by the page's first script: data is on its way while the other scripts are read and WebGL starts.

/** A new connection. What happens to it before `attach` gives it handlers is kept. */
function opened() {
  const token = new URLSearchParams(location.search).get("token");
  const query = token ? `?token=${encodeURIComponent(token)}` : "";
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  const socket = new WebSocket(`${scheme}://${location.host}/live${query}`, "pocd.view.v1");
  socket.binaryType = "arraybuffer";
  const early = [];
  for (const name of ["onopen", "onmessage", "onclose"]) socket[name] = (event) => early.push(event);
  return { socket, early };
}

let first = opened();

/** The connection that the page began with, for who asks first; otherwise a new one. */
export function openSocket() {
  const one = first ?? opened();
  first = null;
  return one;
}

/** Handlers {onopen, onmessage, onclose}: they get what has happened already, and then what happens. */
export function attach({ socket, early }, handlers) {
  Object.assign(socket, handlers);
  for (const event of early.splice(0)) handlers[`on${event.type}`](event);
}
