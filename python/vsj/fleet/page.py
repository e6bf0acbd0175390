"""The summary as one HTML page, which needs no other file."""

from html import escape
NAME = "fleet.html"
def page(found, records, settings):
    return escape(repr(found))
