"""Tools that compare compiled networks with other programs; they need numpy, and some need Mitsuba 3."""
