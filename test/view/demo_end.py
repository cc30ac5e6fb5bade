#!/usr/bin/env python3
"""The last step of demo.sh: on a terminal the page stays up until Ctrl-C, elsewhere it ends by itself.

The script is the real one, and so is pocd_view; what takes minutes (build, run) is replaced by programs
that end at once. Usage: demo_end.py SOURCE_DIR BIN_DIR
"""
import os
import pty
import re
import select
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

PATIENCE_S = 60  # far more than anything takes

# Bash cannot trap what was ignored when it began, as Ctrl-C is of programs in the background.
UNTIL_INTERRUPTED = """exec python3 -c '
import signal, sys
signal.signal(signal.SIGINT, lambda *_: sys.exit(print("done")))
while True: signal.pause()'"""

PROGRAMS = {
    "install_dependencies.sh": "exit 0",
    "build.sh": "exit 0",
    "pocd_mirror": "sleep 1; echo mirrored",
    "pocd_node": UNTIL_INTERRUPTED,
    "pocd_play": "sleep 0.5",
    "pocd_demo_report": "echo the report",
}


def tree(source, bin_dir, top):
    """A workspace in which demo.sh finds what it calls."""
    (top / "launch_scripts").mkdir()
    (top / "install/bin").mkdir(parents=True)
    for name in ("demo.sh", "loopback.xml"):
        shutil.copy(source / "launch_scripts" / name, top / "launch_scripts" / name)
    for name, text in PROGRAMS.items():
        program = top / ("launch_scripts" if name.endswith(".sh") else "install/bin") / name
        program.write_text(f"#!/usr/bin/env bash\n{text}\n")
        program.chmod(0o755)
    os.symlink(bin_dir / "pocd_view", top / "install/bin/pocd_view")
    return top / "launch_scripts/demo.sh"


def of_session(session):
    """Programs of a session that have not ended."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, rest = stat.read_text().rsplit(") ", 1)
        except OSError:
            continue
        state, _, _, its_session = rest.split()[:4]
        if int(its_session) == session and state != "Z":
            found.append(name.split("(", 1)[1])
    return found


class OnTerminal:
    def __init__(self, *command):
        self.text = ""
        self.pid, self.terminal = pty.fork()
        if self.pid == 0:
            os.execv(command[0], command)

    def read(self, until):
        """Reads until the pattern comes; None: until the end."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            found = until and re.search(until, self.text)
            if found:
                return found
            if not select.select([self.terminal], [], [], 1.0)[0]:
                continue
            try:
                part = os.read(self.terminal, 4096)
            except OSError:  # closed on the other side
                part = b""
            if not part:
                break
            self.text += part.decode(errors="replace")
        if until:
            raise AssertionError(f"never came: {until}\n{self.text}")
        return None

    def ended(self):
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                return os.waitstatus_to_exitcode(status)
            time.sleep(0.05)
        raise AssertionError(f"does not end\n{self.text}")


def check(holds, what):
    if not holds:
        raise AssertionError(what)


def status_of(address):
    with urllib.request.urlopen(address, timeout=PATIENCE_S) as page:
        return page.status, page.read().decode()


def on_a_terminal(demo):
    run = OnTerminal(str(demo))
    address = run.read(r"the page stays up at (http://\S+/\S*); Ctrl-C ends it")[1]
    check("the report" in run.text and f"live page: {address}" in run.text, run.text)
    status, page = status_of(address)
    check(status == 200 and "<title>POCD map</title>" in page, f"{address}: {status}")
    time.sleep(1.0)
    check(os.waitpid(run.pid, os.WNOHANG) == (0, 0), "the page does not stay up")
    check("pocd_view" in of_session(run.pid), f"{of_session(run.pid)} run")
    os.write(run.terminal, b"\x03")
    run.read(None)
    check(run.ended() == 0, f"Ctrl-C ends it with another code than 0\n{run.text}")
    check(of_session(run.pid) == [], f"{of_session(run.pid)} are left over")
    print(f"on a terminal: {address} answers {status} until Ctrl-C, exit code 0, nothing left over")


def without_the_page(demo):
    run = OnTerminal(str(demo), "--no-view")
    run.read(None)
    check(run.ended() == 0 and "http:" not in run.text, run.text)
    check("the report" in run.text and of_session(run.pid) == [], f"{of_session(run.pid)}\n{run.text}")
    print("on a terminal with --no-view: no page, exit code 0, nothing left over")


def without_a_terminal(demo):
    run = subprocess.Popen([demo], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                           stderr=subprocess.STDOUT, text=True, start_new_session=True)
    text, _ = run.communicate(timeout=PATIENCE_S)
    check(run.returncode == 0 and "http:" not in text and "the report" in text, text)
    check(of_session(run.pid) == [], f"{of_session(run.pid)} are left over")
    print("without a terminal: no page, exit code 0, nothing left over")


def main():
    source, bin_dir = (Path(argument).resolve() for argument in sys.argv[1:3])
    for case in (on_a_terminal, without_the_page, without_a_terminal):
        with tempfile.TemporaryDirectory() as folder:
            case(tree(source, bin_dir, Path(folder)))


main()
