// The keys, and what the colours mean.

export const keyTable = [
  { keys: ["Home", "h", "H"], shown: "Home, H", action: "home", words: "the whole map" },
  { keys: ["t", "T"], shown: "T", action: "top", words: "view from above, and back" },
  { keys: ["f", "F"], shown: "F", action: "follow", words: "follow a robot, the next one, none" },
  { keys: ["m", "M"], shown: "M", action: "measure", words: "measure between two points" },
  { keys: ["b", "B"], shown: "B", action: "split", words: "before and after side by side" },
  { keys: ["d", "D"], shown: "D", action: "theme", words: "dark or light" },
  { keys: ["l", "L"], shown: "L", action: "link", words: "copy a link to this view" },
  { keys: [" "], shown: "Space", action: "play", words: "play from the shown time on, pause" },
  { keys: ["n", "N", "End"], shown: "N, End", action: "live", words: "back to now, or to the end" },
  { keys: ["Escape"], shown: "Esc", action: "escape", words: "nothing selected" },
  { keys: ["ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"], shown: "arrows", words: "move over the map" },
  { keys: ["+", "=", "-"], shown: "+ -", words: "nearer, farther" },
  { keys: ["?"], shown: "?", action: "help", words: "this list" },
];

const swatch = (colour, dashed) => `<span class="swatch ${dashed ? "dashed" : ""}" style="border-color:var(--${colour})"></span>`;

export function helpHtml() {
  const keys = keyTable.map((row) => `<tr><td><kbd>${row.shown}</kbd></td><td>${row.words}</td></tr>`).join("");
  return `<h2>Keys</h2><table>${keys}</table>
    <p>Drag turns the view, drag with the right button or two fingers moves it, wheel or pinch goes nearer. A click on a box selects it.</p>
    <p>On the time line a click or a drag shows another time, the wheel zooms; drag the triangle to say since when changes are shown.</p>
    <h2>Colours</h2><table>
    <tr><td>${swatch("added")}</td><td>added since the marker of the time line</td></tr>
    <tr><td>${swatch("moved")} ${swatch("moved", true)}</td><td>moved: where it is, and dashed where it was, with an arrow</td></tr>
    <tr><td>${swatch("removed", true)}</td><td>removed: where it was</td></tr>
    <tr><td>${swatch("unknown", true)}</td><td>not looked at since the node was started again; the map there is striped</td></tr>
    <tr><td>${swatch("robot")}</td><td>a robot's camera and what it can see</td></tr></table>
    <p>Surfaces and boxes have the colour of E[v], the probability that the object stays where it is: red moves, green stays.</p>
    <form method="dialog"><button class="kind">Close</button></form>`;
}
