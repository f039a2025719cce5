"""Suggestions for a command that lacks its arguments, with files from this folder."""

from __future__ import annotations

from pathlib import Path

import typer
from typer.core import TyperCommand

from viewsphere.errors import UserError
from viewsphere.kernels.garbage import importing

RECIPES = ("[!.]*.yaml", "[!.]*.yml", "[!.]*/recipe.yaml", "recipes/*.yaml")


class Command(TyperCommand):
    """A command that suggests arguments if it needs some and got none."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Parse the arguments by typer; raises UserError with a suggestion if arguments are required and none is given."""
        if not args and not ctx.resilient_parsing and any(p.required for p in self.params):
            raise UserError(for_command(ctx.info_name or ""))
        with importing():  # which callbacks of options do
            return super().parse_args(ctx, args)  # pyright: ignore[reportArgumentType]


def for_command(name: str) -> str:
    """A message of the arguments that a command expects, with an example made of files found here."""
    data = _near("*/store/plan.json", "store/plan.json")
    folder = data[0].parent.parent if data else Path("cars-ds")
    advice = f"found {folder} here" if data else "no data set yet? `viewsphere render` makes one"
    match name:
        case "new":
            return "new: expected a folder for the recipe; found none\nit need not exist; next: viewsphere new cars"
        case "inspect":
            from viewsphere.plugins.source import model_for

            near = next(iter(_near(*_models())), None)
            here = "no model at hand? some come with viewsphere" if near is None else f"found {near} here"
            model = near or model_for("example", otherwise="car.obj")
            return f"inspect: expected a model; found none\n{here}; next: viewsphere inspect {model}"
        case "plan" | "preview":
            return f"{name}: expected a recipe; found none\n{_recipe_here()}; next: viewsphere {name} {_recipe()}"
        case "merge":
            two = " ".join(str(p.parent.parent) for p in data[:2]) if len(data) > 1 else "cars-ds chairs-ds"
            return f"merge: expected two data sets or more; found none\nnext: viewsphere merge {two} -o both"
        case "import":
            return "import: expected a format and a folder; found none\nnext: viewsphere import coco my-photos -o photos-ds"
        case "convert":
            need = "convert: expected a folder, --from and --to; found none"
            return f"{need}\nnext: viewsphere convert my-photos --from coco --to yolo -o photos"
        case "export":
            return f"export: expected a data set and --format; found none\n{advice}; next: viewsphere export {folder} -f coco"
        case _:
            return f"{name}: expected a data set; found none\n{advice}; next: viewsphere {name} {folder}"


def _models() -> tuple[str, ...]:
    """Patterns of model files in this folder and those below."""
    from viewsphere.assets.readers import suffixes

    return tuple(f"{folder}[!.]*.{suffix}" for folder in ("", "[!.]*/") for suffix in suffixes(by_blender=False))


def for_render(given: Path | None, output: Path | None) -> str:
    """The message for `render`, which may lack its recipe, its output folder or both."""
    if given is None:
        first = _recipe_here()
        found = "found nothing" if output is None else "found no recipe"
    else:
        first, found = "the folder need not exist", f"found no folder for {given}"
    source = given or _recipe()
    folder = output or Path(f"{source.parent.name or source.stem}-ds")
    return f"render: expected a recipe and -o FOLDER; {found}\n{first}; next: viewsphere render {source} -o {folder}"


def _recipe() -> Path:
    """A recipe found here, or the path of the one that `viewsphere new cars` would write."""
    return next(iter(_near(*RECIPES)), Path("cars/recipe.yaml"))


def _recipe_here() -> str:
    return f"found {_recipe()} here" if _near(*RECIPES) else "no recipe yet? `viewsphere new cars` writes one"


def _near(*patterns: str) -> list[Path]:
    return [file for pattern in patterns for file in sorted(Path().glob(pattern))]
