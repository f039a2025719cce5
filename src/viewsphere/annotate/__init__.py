"""Labels: everything that is said of the objects in a picture, computed from truth's triangles."""

from viewsphere.annotate.objects import annotate

__all__ = ["annotate"]
