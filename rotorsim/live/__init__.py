"""A live rig: the plant runs beside the clock and a page in the browser turns its controls and shows what it does.

`rig` is the running machine without any clock, `runner` paces it in a thread, `frame` makes what a page draws of it;
`server` and `page` are the only ones that know the web.
"""
