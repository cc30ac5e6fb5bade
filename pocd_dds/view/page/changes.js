// What has changed between two times, of all events.

/** The last event of each object that has changed from `since` until `until`, of `events` in the order of their stamps. */
export function changesBetween(events, since, until) {
  const last = new Map();
  for (const event of events) {
    if (event.kind === "UPDATED" || event.stamp < since || event.stamp > until) continue;
    if (event.kind === "OPERATOR") { last.delete(event.id); continue; }
    const first = last.get(event.id);
    if (event.kind === "REMOVED" && first?.kind === "ADDED") last.delete(event.id);
    else if (event.kind === "MOVED" && first?.kind === "ADDED") last.set(event.id, { ...event, kind: "ADDED" });
    else if (event.kind === "MOVED" && first?.kind === "MOVED") last.set(event.id, { ...event, previous: first.previous });
    else last.set(event.id, event);
  }
  return [...last.values()];
}
