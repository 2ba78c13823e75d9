"""What the report is made of: topics, each with figures and the studies whose tables stand beside them."""
import dataclasses
import typing


@dataclasses.dataclass(frozen=True)
class Figure:
    """draw(results) answers a matplotlib figure, or raises data.NotDrawn."""
    id: str  # stable: links and tests rely on it
    title: str
    caption: str
    draw: typing.Callable


@dataclasses.dataclass(frozen=True)
class Topic:
    """owns(study): does this study's table stand here? The first topic that says so takes it."""
    id: str
    title: str
    figures: tuple
    owns: typing.Callable


def with_settings(**wanted):
    """For Topic.owns: studies with these settings."""
    return lambda study: all(str(study.settings.get(key)) == str(value) for key, value in wanted.items())
