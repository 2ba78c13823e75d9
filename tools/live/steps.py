"""Steps of one run, as `--looks -` of the runner gives them, and the names of the flags in them."""
import json
import pathlib
import re
import subprocess
import threading

HEALTH_H = pathlib.Path(__file__).resolve().parents[2] / "lib/include/pflight/health.h"
NO_FLAGS = {("event", "RESAMPLED")}  # an event of every other cycle: shown by itself


def names():
    """Kind -> mask -> name, and "phase" -> number -> name, out of the library's header."""
    text = HEALTH_H.read_text(encoding="utf-8")
    found = {kind: {int(mask, 16): name for name, mask in
                    re.findall(rf"#define PFL_{kind.upper()}_(\w+) 0x([0-9a-fA-F]+)u", text)}
             for kind in ("fault", "mode", "event")}
    found["phase"] = {int(number): name for name, number in re.findall(r"PFL_PHASE_(\w+) = (\d+)", text)}
    return found


def flags(step, known):
    """The flags that a step raises, in words; a refused measurement by the number of its sensor."""
    raised = [f"{kind} {name}" for kind in ("fault", "mode", "event") for mask, name in known[kind].items()
              if step[kind] & mask and (kind, name) not in NO_FLAGS]
    return raised + [f"refused sensor {k}" for k in range(step["reject"].bit_length()) if step["reject"] >> k & 1]


class Steps:
    """The runner's lines, while it still runs: line 0 tells what is shown, the others are steps, the last is the hash."""

    def __init__(self, command):
        # pylint: disable=consider-using-with
        self._process = subprocess.Popen([*command, "--looks", "-"], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                         stderr=subprocess.PIPE, text=True, encoding="utf-8")
        self._lines = []
        self._news = threading.Condition()
        self.code = None  # of the runner, once it has ended
        self.said = ""  # its standard error
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self._process.stdout:
            with self._news:
                self._lines.append(line.rstrip("\n"))
                self._news.notify_all()
        said = self._process.stderr.read()
        code = self._process.wait()
        with self._news:
            self.said, self.code = said, code
            self._news.notify_all()

    def wait(self, after, timeout_s=None):
        """The lines from number `after` on, as soon as there are some; none: the run has ended, or time is up."""
        with self._news:
            self._news.wait_for(lambda: len(self._lines) > after or self.code is not None, timeout_s)
            return self._lines[after:]

    @property
    def head(self):
        return json.loads(self._lines[0])

    def stop(self):
        if self._process.poll() is None:
            self._process.kill()
