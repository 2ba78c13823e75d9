"""tools/budgets must notice: more than 2 % over a budget, by name, and a figure without one."""
import copy
import importlib.machinery
import importlib.util
import io
import contextlib
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.dont_write_bytecode = True
loader = importlib.machinery.SourceFileLoader("budgets", str(ROOT / "tools/budgets"))
budgets = importlib.util.module_from_spec(importlib.util.spec_from_loader("budgets", loader))
loader.exec_module(budgets)

MEASURED = {
    "instructions": {"cortex-m4f": {"compiler": "x", "land-vehicle": {"300": {"mean": 10000, "worst": 20000,
                                                                             "arena_bytes": 10016}}}},
    "flash_bytes": {"filter": 1000}, "land_vehicle_flash_bytes": {"filter": 900}, "stack_bytes": {"pfl_predict": 300},
}


def verdict(change):
    now = copy.deepcopy(MEASURED)
    change(now)
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        good = budgets.check(now, MEASURED)
    return good, said.getvalue()


def cost(now):
    return now["instructions"]["cortex-m4f"]["land-vehicle"]["300"]


assert verdict(lambda now: None) == (True, "")
assert verdict(lambda now: cost(now).update(mean=10200))[0], "2 % is allowed"
for change, name in [
    (lambda now: cost(now).update(mean=10201), "land-vehicle on cortex-m4f, N = 300, mean cycle"),
    (lambda now: cost(now).update(worst=20401), "land-vehicle on cortex-m4f, N = 300, worst cycle"),
    (lambda now: now["flash_bytes"].update(filter=1021), "flash of filter"),
    (lambda now: now["stack_bytes"].update(pfl_predict=312), "stack of pfl_predict"),
    (lambda now: now["stack_bytes"].update(pfl_new=8), "no budget for stack of pfl_new"),
]:
    good, said = verdict(change)
    assert not good and name in said, (name, said)
print("tools/budgets notices what it should")
