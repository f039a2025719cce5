"""A data set of any size as a page that lives: a server for one's own browser, which reads only what is shown."""

from viewsphere.view.live import Live
from viewsphere.view.server import PORT, Address, Server

__all__ = ["PORT", "Address", "Live", "Server"]
