"""The zoo as a source of models and places: `zoo:car`, `zoo:any`, `zoo:town`."""

from __future__ import annotations

from collections.abc import Callable

from viewsphere import plugins
from viewsphere.errors import UserError
from viewsphere.model.credit import Credit
from viewsphere.model.model_spec import ModelSpec
from viewsphere.plugins.family import ZooFamily
from viewsphere.plugins.place import PlaceSpec
from viewsphere.plugins.source import Download, SourceModel, SourceSpec
from viewsphere.validation.errors import one_of
from viewsphere_zoo import ANY, build_zoo_model, family, family_names, things

CREDIT = Credit(licence="Apache-2.0", attribution="The viewsphere contributors")


def expand(name: str) -> tuple[SourceModel, ...]:
    """The families that a name selects. Raises UserError for an unknown name."""
    if name == ANY:
        return tuple(map(SourceModel, things()))
    if name not in family_names():
        raise UserError(one_of(name, family_names()))
    return (SourceModel(name),)


def facts(name: str) -> ZooFamily | None:
    """The spec of a family; None for other names."""
    return family(name) if name in family_names() else None


def credit(model: ModelSpec) -> Credit | None:
    """The project's credit; None for a family of another distribution."""
    return None if plugins.is_third_party("families", model.source.partition(":")[2]) else CREDIT


def bodies_file() -> str | None:
    """The file of MakeHuman's bodies; None if it does not exist."""
    from viewsphere_zoo.people import makehuman

    return makehuman.where()


def fetch_bodies(report: Callable[[str], None]) -> None:
    """Download MakeHuman's bodies (CC0, 48 MB) and store the 2 MB that people need."""
    from viewsphere_zoo.people import makehuman

    makehuman.set_up(report)


SOURCE = SourceSpec(
    names=family_names,
    expand=expand,
    load=build_zoo_model,
    credit=credit,
    drawn=True,
    versioned=lambda name: not plugins.is_third_party("families", name),
    family=facts,
    places=lambda: plugins.names("places"),
    place=lambda name: plugins.load(PlaceSpec, name),
    roles={"example": "car", "table": "plain_table", "box": "open_box"},
    downloads={
        "people": Download("mannequins; MakeHuman's bodies by viewsphere doctor --setup people", fetch_bodies, bodies_file)
    },
)
