"""A live page for data sets of any size: a server for the user's own browser, which reads only the shown frames."""

from viewsphere.view.live import Live
from viewsphere.view.server import PORT, Address, Server

__all__ = ["PORT", "Address", "Live", "Server"]
