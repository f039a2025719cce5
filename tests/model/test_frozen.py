"""Plain data: classes are built when they are first used, and read and written as if they were built at once."""

import pickle
import subprocess
import sys

import pytest
from pydantic import BaseModel, Field, ValidationError

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.listed import ListedObject, ListedShot


class Wheel(Frozen):
    """A wheel."""

    radius: float = Field(gt=0, description="metres")


class Axle(OmitNone):
    """Two wheels."""

    OMIT_IF_NONE = ("load",)

    wheels: tuple[Wheel, ...]
    load: float | None = None


class Cart(Frozen):
    """A cart."""

    axles: tuple[Axle, ...] = ()
    spare: Wheel | None = None


CART = {"axles": [{"wheels": [{"radius": 0.5}, {"radius": 1}]}], "spare": None}


def _is_built(kind: type[BaseModel]) -> bool:
    return "__pydantic_complete__" in vars(kind) and kind.__pydantic_complete__


def test_a_class_is_built_when_it_is_first_used_and_not_with_one_that_holds_it():
    class Inner(Frozen):
        number: int = 0

    class Outer(Frozen):
        inner: Inner | None = None
        other: int = 0

    assert not _is_built(Outer)
    Outer(other=1)
    assert _is_built(Outer)
    assert not _is_built(Inner)
    assert Outer(inner={"number": 2}).inner == Inner(number=2)  # pyright: ignore[reportArgumentType]
    assert _is_built(Inner)


def test_parts_are_read_and_written_as_their_own_classes_do():
    cart = Cart.model_validate(CART)

    assert cart.model_dump(mode="json") == {"axles": [{"wheels": [{"radius": 0.5}, {"radius": 1.0}]}], "spare": None}
    assert Cart.model_validate_json(cart.model_dump_json()) == cart
    assert cart.model_dump(exclude={"axles": {"__all__": {"wheels": {0}}}})["axles"] == ({"wheels": ({"radius": 1.0},)},)
    assert Cart(spare=Wheel(radius=1)).model_dump(exclude_defaults=True) == {"spare": {"radius": 1.0}}


def test_a_mistake_in_a_part_is_told_with_its_place():
    with pytest.raises(ValidationError) as mistake:
        Cart.model_validate({"axles": [{"wheels": [{"radius": 1}, {"radios": 1}]}]})

    places = {error["loc"]: error["msg"] for error in mistake.value.errors()}
    message = "expected no field but radius; found 'radios'; did you mean 'radius'?"
    assert places == {("axles", 0, "wheels", 1, "radios"): message}


def test_the_schema_describes_each_part_once():
    schema = Cart.model_json_schema()

    assert set(schema["$defs"]) == {"Axle", "Wheel"}
    assert schema["properties"]["axles"]["items"] == {"$ref": "#/$defs/Axle"}
    assert schema["$defs"]["Axle"]["properties"]["wheels"]["items"] == {"$ref": "#/$defs/Wheel"}
    assert schema["$defs"]["Wheel"]["properties"]["radius"]["exclusiveMinimum"] == 0


def test_what_came_from_another_process_is_written_where_its_class_was_not_used_before():
    pose = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
    shot = ListedShot(world_from_camera=pose, objects=(ListedObject(model="car", world_from_object=pose),))
    code = f"""
import pickle
from viewsphere.model.listed import ListedObject, ListedShot
shot = pickle.loads({pickle.dumps(shot)!r})
assert not ListedShot.__pydantic_complete__ and not ListedObject.__pydantic_complete__
print(shot.model_dump_json())
"""
    there = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)

    assert there.stdout.strip() == shot.model_dump_json()
