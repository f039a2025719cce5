"""Every recipe of recipes/ and recipes/labels renders as it is shipped."""

from shipped import each_renders, models_built_once

__all__ = ["models_built_once"]

test_a_recipe_renders_as_it_is_shipped = each_renders(".", "labels")
