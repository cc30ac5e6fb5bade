#!/usr/bin/env python3
"""Makes scenes with pocd_changed_scene, runs pocd_map on each, and scores what it told of the second lap.

Net change of each object over the second lap: what was added and moved was added, what was added and removed is
nothing. A true change is
  exact     when there is a net change of its kind with its places: a box's middle lies in the true footprint, grown
            by 0.35 m (the old one for REMOVED, the new one for ADDED, both for MOVED);
  in place  also when it is told as another kind there: a move as REMOVED and ADDED, or one of the two.
Further net changes within 0.5 m of a true change's footprint are duplicates, all others are false. A false ADDED with the
arrival `found` is a thing that was seen for the first time; it is not said to have come. What nobody could see is not
asked. F1 is that of exact changes: 2 exact / (true changes + told ones).
With --no-masks the segmentation images are left out. By hand, not a test.
usage: changed_scenes.py BIN_DIR MESH_DIR OUTPUT_DIR SEEDS [--no-masks] [KIND...]   (SEEDS: 1-8 or 1,5,9; KIND: circuit,
warehouse)
"""
import concurrent.futures
import csv
import math
import pathlib
import subprocess
import sys

CAMERA = "320,180,230.54780578613281,230.45909118652344,162.7390213,88.78831482"
SECOND_LAP_S = {"circuit": 240 / 15, "warehouse": 260 / 10}  # after the first frame
START_S = 1000
KIND_OF = {"added": "ADDED", "moved": "MOVED", "removed": "REMOVED"}
FOOTPRINT_M, NEAR_M = 0.35, 0.5


class Change:
    """A thing of the truth that changed."""

    def __init__(self, words):
        values = [float(word) for word in words[3:15]]
        self.name, self.state = words[0], words[2]
        self.new, self.old, self.low, self.high = (values[i:i + 3] for i in (0, 3, 6, 9))
        self.seen = words[15] != "-1"

    def holds(self, point, pose, margin_m):
        dx, dy, yaw = point[0] - pose[0], point[1] - pose[1], -pose[2]
        across = (math.cos(yaw) * dx - math.sin(yaw) * dy, math.sin(yaw) * dx + math.cos(yaw) * dy)
        return all(self.low[i] - margin_m <= across[i] <= self.high[i] + margin_m for i in (0, 1))

    def at_new(self, point, margin_m=FOOTPRINT_M):
        return self.state != "removed" and point is not None and self.holds(point, self.new, margin_m)

    def at_old(self, point, margin_m=FOOTPRINT_M):
        return self.state != "added" and point is not None and self.holds(point, self.old, margin_m)

    def is_exactly(self, told):
        if told.kind != KIND_OF[self.state]:
            return False
        return (self.state == "added" or self.at_old(told.old)) and (self.state == "removed" or self.at_new(told.new))

    def is_in_place(self, told):
        """Told as another kind: by one of its places."""
        return self.at_new(told.new) or self.at_old(told.old)

    def is_near(self, told):
        return self.at_new(told.new, NEAR_M) or self.at_old(told.old, NEAR_M)


class Told:
    """What became of one object in the second lap."""

    def __init__(self, kind, old, new, arrival=""):
        self.kind, self.old, self.new, self.arrival = kind, old, new, arrival


def net_changes(events_csv, kind):
    begin_ns = (START_S + SECOND_LAP_S[kind] - 0.05) * 1e9
    told = {}
    with open(events_csv, newline="") as file:
        for row in csv.DictReader(file):
            if int(row["stamp_ns"]) < begin_ns:
                continue
            if row["absorbed"]:
                told.pop(row["absorbed"], None)
            number, here = row["object_id"], (float(row["x"]), float(row["y"]))
            before = told.get(number)
            was_added = before is not None and before.kind == "ADDED"
            if row["kind"] == "ADDED" or (row["kind"] == "MOVED" and was_added):
                told[number] = Told("ADDED", None, here, before.arrival if was_added else row["arrival"])
            elif row["kind"] == "MOVED":
                old = (float(row["previous_x"]), float(row["previous_y"]))
                told[number] = Told("MOVED", before.old if before and before.old else old, here)
            elif row["kind"] == "REMOVED" and was_added:
                del told[number]
            elif row["kind"] == "REMOVED":
                told[number] = Told("REMOVED", before.old if before and before.kind == "MOVED" else here, None)
    return list(told.values())


def score(truth, events_csv, kind):
    changes = [Change(line.split()) for line in truth.read_text().splitlines()]
    changes = [c for c in changes if c.state != "kept" and (c.seen or c.state != "added")]
    left = net_changes(events_csv, kind)
    total = len(left)
    exact = place = 0
    for change in changes:
        of_kind = [t for t in left if change.is_exactly(t)]
        if of_kind:
            exact += 1
            total -= len(of_kind) - 1  # pieces of one change
            left = [t for t in left if t not in of_kind]
        elif any(change.is_in_place(t) for t in left):
            in_place = [t for t in left if change.is_in_place(t)]
            total -= len(in_place) - 1
            left = [t for t in left if t not in in_place]
        else:
            continue
        place += 1
    duplicates = [t for t in left if any(c.is_near(t) for c in changes)]
    false = [t for t in left if t not in duplicates]
    gone = sum(t.kind != "ADDED" for t in false)
    found = sum(t.arrival == "found" for t in false)
    f1 = 2 * exact / max(1, len(changes) + total)
    return {"changes": len(changes), "exact": exact, "place": place, "duplicates": len(duplicates), "false": len(false),
            "gone": gone, "found": found, "F1": f1}


def without_masks(lap):
    bare = lap.parent / "without_masks" / lap.name
    bare.mkdir(parents=True, exist_ok=True)
    for name in ("Depth", "poses.txt"):
        if not (bare / name).exists():
            (bare / name).symlink_to(lap / name)
    return bare


def run(bin_dir, meshes, output, kind, seed, masks):
    scene = output / f"{kind}_{seed}"
    if not (scene / "truth_objects.txt").exists():
        subprocess.run([bin_dir / "pocd_changed_scene", kind, str(seed), scene] + ([meshes] if kind == "warehouse" else []),
                       check=True)
    config = pathlib.Path(__file__).resolve().parents[2] / "config" / "torwic.yaml"
    laps, results, options = [scene / "lap_0", scene / "lap_1"], scene / "run", []
    if not masks:
        laps, results = [without_masks(lap) for lap in laps], scene / "run_without_masks"
        options = ["--set", "classes.without_masks=things"]
    subprocess.run([bin_dir / "pocd_map", "--dataset", "torwic", "--input", laps[0], "--input", laps[1], "--camera", CAMERA,
                    "--config", config, *options, "--output", results], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL)
    return score(scene / "truth_objects.txt", results / "events.csv", kind)


def seeds_of(text):
    if "-" in text:
        first, last = text.split("-")
        return list(range(int(first), int(last) + 1))
    return [int(seed) for seed in text.split(",")]


def text_of(name, scores):
    total = {key: sum(s[key] for s in scores) for key in scores[0]}
    return (f"| {name} | {total['exact']} of {total['changes']} | {total['place']} | {total['duplicates']} | "
            f"{total['false']} | {total['gone']} | {total['found']} | {total['F1'] / len(scores):.3f} |")


def main():
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    bin_dir, meshes, output = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
    options = sys.argv[5:]
    masks = "--no-masks" not in options
    seeds, kinds = seeds_of(sys.argv[4]), [o for o in options if o != "--no-masks"] or list(SECOND_LAP_S)
    print("| scene | exact | places | duplicates | false | of these gone | of these found | F1 |\n"
          "|---|---:|---:|---:|---:|---:|---:|---:|")
    with concurrent.futures.ThreadPoolExecutor(max_workers=2) as pool:
        runs = {kind: [(seed, pool.submit(run, bin_dir, meshes, output, kind, seed, masks)) for seed in seeds] for kind in kinds}
        for kind in kinds:
            scores = []
            for seed, result in runs[kind]:
                scores.append(result.result())
                print(text_of(f"{kind} {seed}", scores[-1:]), flush=True)
            print(text_of(f"{kind}, all", scores), flush=True)


if __name__ == "__main__":
    main()
