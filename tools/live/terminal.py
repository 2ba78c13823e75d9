"""The particles in a terminal: eight dots to a character where it knows Braille, the truth as +, the estimate as o."""
import json
import os
import select
import shutil
import sys
import termios
import time
import tty

from steps import flags, names

DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # Braille, by row and column
KEYS = "space: pause or go on   n: one step   + -: faster, slower   q: end"
SPREADS = 5.0  # standard deviations on either side of the estimate that are shown


class View:
    """What is seen: the middle goes with the estimate, the scale follows its spread, as smoothly as a factor of two."""

    def __init__(self):
        self.reach = None

    def bounds(self, step, columns, rows):
        (x, y), sigma = step["estimate"], max(max(step["sigma"]), 1e-9)
        wanted = SPREADS * sigma
        if step["truth"][0] is not None and step["truth"][1] is not None:
            wanted = max(wanted, 1.2 * abs(step["truth"][0] - x), 1.2 * abs(step["truth"][1] - y))
        if self.reach is None or not 0.5 * self.reach < wanted < self.reach:
            self.reach = 1.4 * wanted
        wide = self.reach * max(1.0, 0.5 * columns / rows)  # a character is twice as high as wide
        return x - wide, y - wide * 2.0 * rows / columns, 2.0 * wide, 4.0 * wide * rows / columns


def picture(step, view, columns, rows, braille):
    left, bottom, width, height = view.bounds(step, columns, rows)
    cells = {}

    def place(x, y, fine_x, fine_y):
        column = int((x - left) / width * columns * fine_x)
        row = int((1.0 - (y - bottom) / height) * rows * fine_y)
        return (row, column) if 0 <= column < columns * fine_x and 0 <= row < rows * fine_y else None

    cloud = step.get("cloud", [])
    for x, y in zip(cloud[0::2], cloud[1::2]):
        if at := place(x, y, 2, 4):
            cell = at[0] // 4, at[1] // 2
            cells[cell] = cells.get(cell, 0) | DOTS[at[0] % 4][at[1] % 2]
    drawn = {cell: chr(0x2800 + dots) if braille else "." for cell, dots in cells.items()}
    for point, mark, color in ((step["truth"], "+", 32), (step["estimate"], "o", 36)):
        if None not in point and (at := place(*point, 1, 1)):
            drawn[at] = f"\x1b[1;{color}m{mark}\x1b[0m"
    lines = ["".join(drawn.get((row, column), " ") for column in range(columns)).rstrip() for row in range(rows)]
    return lines, (width, height)


def status(step, head, known, extent, rate, paused):
    bar = "#" * round(20 * step["ess"] / step["n"])
    lines = [f"{head['scenario']}   t = {step['t']:.2f} s   {'paused' if paused else f'{rate:g} times as fast'}"]
    for axis, wide, estimate, sigma, truth in zip(head["axes"], extent, step["estimate"], step["sigma"], step["truth"]):
        error = "" if truth is None else f", off by {estimate - truth:.3g} from the {head['against']} +"
        lines.append(f"{axis}: estimate o {estimate:.5g} +- {sigma:.3g}{error}; the picture is {wide:.3g} wide")
    return lines + [
        f"effective sample size [{bar:20}] {step['ess']:.0f} of {step['n']}{', resampled' if step['resampled'] else ''}",
        f"cycle {step['us']:.1f} of {head['budget_us']:g} us; phase {known['phase'][step['phase']] if step['phase'] else 'not judged'}; "
        f"{', '.join(flags(step, known)) or 'no flag'}", KEYS]


def draw(step, head, known, view, rate, paused):
    columns, height = shutil.get_terminal_size()
    braille = (sys.stdout.encoding or "").lower().replace("-", "") == "utf8"
    lines, extent = picture(step, view, columns, max(height - 7, 1), braille)
    lines += [line[:columns] for line in status(step, head, known, extent, rate, paused)]
    sys.stdout.write("\x1b[H" + "\x1b[K\r\n".join(lines) + "\x1b[J")
    sys.stdout.flush()


def key(timeout_s):
    ready, _, _ = select.select([sys.stdin], [], [], max(timeout_s, 0.0))
    return os.read(sys.stdin.fileno(), 1).decode("ascii", "ignore") if ready else None


def play(steps, head, rate):
    known, view, paused, shown, step = names(), View(), False, 1, None
    due = time.monotonic()
    while True:
        lines = steps.wait(shown, 0.05)
        upcoming = json.loads(lines[0]) if lines else None
        at_end = (upcoming is None and steps.code is not None) or (upcoming is not None and "hash" in upcoming)
        pressed = key(60.0 if paused or at_end else due - time.monotonic())
        if pressed == "q":
            return
        if pressed == " ":
            paused, due = not paused, time.monotonic()
        if pressed in ("+", "-"):
            rate = min(max(rate * (2.0 if pressed == "+" else 0.5), 1e-3), 1e3)
        go = pressed == "n" or (not paused and time.monotonic() >= due)
        if go and upcoming is not None and not at_end:
            due = max(due, time.monotonic() - 0.2) + ((upcoming["t"] - step["t"]) / rate if step else 0.0)
            step, shown = upcoming, shown + 1
        elif pressed is None:
            continue
        if step is not None:
            draw(step, head, known, view, rate, paused)


def show(steps, rate):
    """Until the user ends it."""
    before = termios.tcgetattr(sys.stdin)
    sys.stdout.write("\x1b[?1049h\x1b[?25l\x1b[2J")
    try:
        tty.setcbreak(sys.stdin)
        play(steps, steps.head, rate)
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
        sys.stdout.write("\x1b[?25h\x1b[?1049l")
        sys.stdout.flush()
