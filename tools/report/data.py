"""What tools/run left in its folder: summary.json, and the time series of each study in csv/."""
import csv
import functools
import json
import pathlib


class Unreadable(Exception):
    """The folder holds no summary that can be drawn; the text is one line for a person."""


class NotDrawn(Exception):
    """A figure that cannot be drawn from these results; the text says what lacks."""


class Study:
    """A study of the summary: its fields as attributes, its files on demand."""

    def __init__(self, folder, fields):
        self._folder = folder
        self._fields = fields
        self.id = fields["id"]
        self.scenario = fields["scenario"]
        self.settings = fields["settings"]
        self.metrics = fields["metrics"]
        self.timing = fields["timing"]
        self.special = fields["special"]
        self.hash = fields["hash"]
        self.accepted = fields["accepted"]
        self.summary = fields["summary"]
        self.budget_reason = fields["budget_reason"]
        self.notes = fields["notes"].split("\n")
        self.elapsed_s = fields["elapsed_s"]

    def _table(self, what, text_columns=()):
        """Column -> array; an empty field is not a number."""
        import numpy

        name = self._fields.get(what)
        if name is None:
            raise NotDrawn(f"{self.id} has no {what}")
        path = self._folder / name
        try:
            with path.open(encoding="utf-8", newline="") as lines:
                header, *rows = csv.reader(lines)
        except (OSError, ValueError) as error:
            raise NotDrawn(f"{name} cannot be read") from error
        table = {}
        for i, column in enumerate(header):
            if column in text_columns:
                table[column] = numpy.array([row[i] for row in rows])
            else:
                table[column] = numpy.array([float(row[i] or "nan") for row in rows])
        return Table(f"{name}", table)

    @property
    def series(self):
        """Mean over the runs."""
        return self._table("csv")

    @property
    def trace(self):
        """Run number 0."""
        return self._table("trace")

    @property
    def cloud(self):
        """Particles of run number 0."""
        return self._table("cloud", ("set",))

    @property
    def has_look(self):
        return self._fields.get("look") is not None

    @functools.cached_property
    def look(self):
        """Run number 0 as its filter saw it."""
        try:
            lines = (self._folder / self._fields["look"]).read_text(encoding="utf-8").splitlines()
            return Look([json.loads(line) for line in lines])
        except (OSError, ValueError) as error:
            raise NotDrawn(f"{self._fields['look']} cannot be read") from error

    def metric(self, name):
        if name not in self.metrics:
            raise NotDrawn(f"{self.id} has no metric {name}")
        return self.metrics[name]


class Table:
    """Columns by name; one that is not there is a reason not to draw."""

    def __init__(self, name, columns):
        self.name = name
        self._columns = columns

    def __getitem__(self, column):
        if column not in self._columns:
            raise NotDrawn(f"{self.name} has no column {column}")
        return self._columns[column]

    def __contains__(self, column):
        return column in self._columns


class Look:
    """Steps of a run, and their numbers as arrays; what is unknown is not a number."""

    def __init__(self, lines):
        self.axes = lines[0]["axes"]
        self.against = lines[0]["against"]  # the truth, or what stands in for it
        self.steps = lines[1:]

    def __len__(self):
        return len(self.steps)

    def __getitem__(self, name):
        import numpy

        kind = float if name in ("t", "truth", "estimate", "sigma", "ess", "us") else int
        return numpy.array([step[name] for step in self.steps], dtype=kind)


class Results:
    """All studies, in the order in which they ran."""

    def __init__(self, folder):
        path = pathlib.Path(folder) / "summary.json"
        try:
            summary = json.loads(path.read_text(encoding="utf-8"))
            if summary["schema"] != 1:
                raise ValueError("a summary of another schema than 1")
            self.accepted = summary["accepted"]
            self.skipped = summary["skipped"]
            self.studies = [Study(path.parent, fields) for fields in summary["studies"]]
        except OSError as error:
            raise Unreadable(f"cannot read '{path}': {error.strerror}") from error
        except (KeyError, TypeError, ValueError) as error:
            raise Unreadable(f"'{path}' is no summary of tools/run: {error!r}") from error

    def of(self, scenario, **settings):
        """The studies of a scenario with these settings (filter, particles, ... too), the least special first."""
        found = [study for study in self.studies if study.scenario == scenario and
                 all(str(study.settings.get(key)) == str(value) for key, value in settings.items())]
        return sorted(found, key=lambda study: len(study.id))

    def one(self, scenario, **settings):
        found = self.of(scenario, **settings)
        if not found:
            wanted = " ".join(f"{key}={value}" for key, value in settings.items())
            raise NotDrawn(f"tools/run made no study of {scenario} with {wanted}")
        return found[0]
