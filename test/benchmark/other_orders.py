#!/usr/bin/env python3
"""Runs two laps of a scene that was made elsewhere in other orders, and scores the events.

A scene is a folder with lap_0 and lap_1 (Depth, Segmentation, poses.txt, as TorWIC has them) and the truth of
the second lap. In another order the same frames are other visits: links to them under other numbers, with the
stamps of that order. When the laps change places, so do old and new in the truth.
By hand, not a test.
usage: other_orders.py BIN_DIR SCORER SCENE FRAMES_PER_LAP RATE_HZ OUTPUT_DIR
"""
import pathlib
import subprocess
import sys

CAMERA = "320,180,230.54780578613281,230.45909118652344,162.7390213,88.78831482"

# Name: the laps in their order, each with how its frames are taken.
FORWARDS, BACKWARDS, HALF = slice(None), slice(None, None, -1), slice(None, None, 2)
ORDERS = {
    "as made": ((0, FORWARDS), (1, FORWARDS)),
    "laps in reverse": ((1, FORWARDS), (0, FORWARDS)),
    "each lap backwards": ((0, BACKWARDS), (1, BACKWARDS)),
    "second lap backwards": ((0, FORWARDS), (1, BACKWARDS)),
    "laps in reverse, each backwards": ((1, BACKWARDS), (0, BACKWARDS)),
    "every second frame": ((0, HALF), (1, HALF)),
    "laps in reverse, every second frame": ((1, HALF), (0, HALF)),
}


def link_lap(lap, take, start_s, rate_hz, output):
    """Writes the lap as a folder of its own; its first frame is at start_s [s]."""
    poses = [line.split() for line in (lap / "poses.txt").read_text().splitlines()][take]
    rate_hz = rate_hz / abs(take.step or 1)
    lines = []
    for i, pose in enumerate(poses):
        ns = round(i * 1e9 / rate_hz)
        stamp = [str(i), str(start_s + ns // 10**9), str(ns % 10**9)]
        lines.append(" ".join(stamp + pose[3:]))
        for kind in ("Depth", "Segmentation"):
            (output / kind).mkdir(parents=True, exist_ok=True)
            (output / kind / f"{i:04d}.png").symlink_to(lap / kind / f"{int(pose[0]):04d}.png")
    (output / "poses.txt").write_text("\n".join(lines) + "\n")


def write_truth(scene, swapped, output):
    """name class state, new x y yaw, old x y yaw, low, high, first frame seen (-1: never)."""
    truth = scene / "truth_changes.txt"
    lines = (truth if truth.exists() else scene / "truth_objects.txt").read_text().splitlines()
    rows = []
    for word in (line.split() for line in lines):
        if swapped:
            if word[2] == "added" and word[15] == "-1":
                continue  # nobody saw it
            first = "0" if word[2] == "removed" else word[15]
            state = {"added": "removed", "removed": "added"}.get(word[2], word[2])
            word = word[:2] + [state] + word[6:9] + word[3:6] + word[9:15] + [first]
        rows.append(" ".join(word))
    output.mkdir(parents=True, exist_ok=True)
    (output / "truth_changes.txt").write_text("\n".join(rows) + "\n")


def main():
    if len(sys.argv) != 7:
        sys.exit(__doc__)
    bin_dir, scorer, scene = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
    frames, rate_hz, output = int(sys.argv[4]), float(sys.argv[5]), pathlib.Path(sys.argv[6]).resolve()
    config = pathlib.Path(__file__).resolve().parents[2] / "config" / "torwic.yaml"
    if output.exists():
        sys.exit(f"{output}: is there already")
    for name, order in ORDERS.items():
        folder = output / name.replace(",", "").replace(" ", "_")
        inputs = []
        for visit, (lap, take) in enumerate(order):
            link_lap(scene / f"lap_{lap}", take, 1000 + 500 * visit, rate_hz, folder / f"visit_{visit}")
            inputs += ["--input", folder / f"visit_{visit}"]
        write_truth(scene, order[0][0] == 1, folder)
        subprocess.run([bin_dir / "pocd_map", "--dataset", "torwic", *inputs, "--camera", CAMERA, "--config", config,
                        "--output", folder / "run"], check=True, stdout=subprocess.DEVNULL)
        step = order[0][1].step or 1
        scored = subprocess.run([sys.executable, scorer, folder, folder / "run" / "events.csv", str(frames // abs(step)),
                                 str(rate_hz / abs(step))], check=True, capture_output=True, text=True)
        print(f"{name}: {scored.stdout.splitlines()[-1]}", flush=True)


if __name__ == "__main__":
    main()
