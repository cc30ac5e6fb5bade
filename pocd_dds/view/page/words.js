// Numbers, times and reasons as people read them.

export const escaped = (text) => String(text).replace(/[&<>"']/g, (c) => `&#${c.charCodeAt(0)};`);
export const nameOf = (object) => `${object.class.replaceAll("_", " ")} #${object.number}`;
export const metres = (m) => m < 10 ? `${m.toFixed(2)} m` : `${m.toFixed(1)} m`;
export const placeOf = (box) => `(${box[0].toFixed(2)}, ${box[1].toFixed(2)})`;
export const score = (v) => v.toFixed(2);
const percent = (share) => `${Math.round(100 * share)} %`;

/** Stamps of a clock become a time of day; those that count from the start of a run stay seconds. */
export function timeText(stamp) {
  if (!Number.isFinite(stamp)) return "";
  if (stamp > 1e9) return new Date(1000 * stamp).toLocaleString([], { month: "short", day: "numeric", hour: "2-digit", minute: "2-digit", second: "2-digit" });
  return `${stamp.toFixed(1)} s`;
}

export function durationText(s) {
  if (s < 120) return `${s.toFixed(s < 10 ? 1 : 0)} s`;
  if (s < 7200) return `${Math.round(s / 60)} min`;
  return s < 172800 ? `${(s / 3600).toFixed(1)} h` : `${Math.round(s / 86400)} days`;
}

const rules = {
  stationarity_below_threshold: "the belief that it stays where it is fell below the threshold",
  nothing_left: "nearly all of its surface was seen to be gone",
  another_thing: "what was said to be it at a new place is another thing",
  found_again: "an object that had gone was found again here",
  moved_alike: "it went the way that a thing beside it went",
  aligned_elsewhere: "its surface fits at another place",
  part_removed: "a part of it is gone",
  grew: "more of it was seen",
  part_seen_through: "a part of it was seen to be gone",
  found: "it was found where nobody had looked before",
  arrived: "it stands where it was empty before",
  unknown: "it was seen; whether it stood there before is not known",
  forget_object: "it is to be forgotten",
  confirm_removal: "a person has seen that it is gone",
  forget_region: "everything in a region is to be forgotten",
  ignore_region: "a region is not to be looked at",
  heed_region: "a region is to be looked at again",
  reset: "everything is to be forgotten",
  save: "the memory is to be written",
};

export function ruleText(rule) {
  const joined = /^joined_(\d+)$/.exec(rule);
  if (joined) return `#${joined[1]} turned out to be a part of it`;
  return rules[rule] ?? rule.replaceAll("_", " ");
}

export function shiftOf(event) {
  if (!event.previous) return 0;
  return Math.hypot(event.box[0] - event.previous[0], event.box[1] - event.previous[1], event.box[2] - event.previous[2]);
}

/** One line: what happened. */
export function eventTitle(event) {
  const kind = event.kind.charAt(0) + event.kind.slice(1).toLowerCase();
  if (event.kind === "OPERATOR") return event.number > 0 ? `Forgotten: ${nameOf(event)}` : `Operator: ${ruleText(event.evidence.rule)}`;
  const by = event.kind === "MOVED" ? ` by ${metres(shiftOf(event))}` : "";
  return `${kind}: ${nameOf(event)}${by}`;
}

/** The evidence in sentences: what was measured, what the camera saw, what the belief became. */
export function evidenceSentences(event) {
  const e = event.evidence, lines = [];
  if (event.by) lines.push(`${event.by} said so: ${ruleText(e.rule)}.`);
  else lines.push(`Because ${ruleText(e.rule)}.`);
  if (event.last_there && event.first_gone) {
    lines.push(`It went within ${durationText(Math.max(0, event.first_gone - event.last_there))}: it was last seen in its place at ${timeText(event.last_there)}, and first seen to be gone at ${timeText(event.first_gone)}.`);
  }
  if (event.kind === "OPERATOR") return lines;
  if (e.delta !== 0 || e.sigma !== 0) {
    lines.push(`Measured change: ${metres(Math.abs(e.delta))}, give or take ${metres(e.sigma)}.`);
  }
  if (e.visible > 0) {
    lines.push(`The camera could judge ${percent(e.visible)} of its surface and saw through ${percent(e.seen_through)} of that.`);
  }
  if (e.c1 + e.c2 > 0) lines.push(`The measurement is an inlier with probability ${score(e.c1)}.`);
  lines.push(`Belief that it stays, E[v]: ${score(e.before.v)} before, ${score(e.after.v)} after.`);
  return lines;
}
