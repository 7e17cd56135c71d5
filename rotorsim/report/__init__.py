"""Reports: records in, figures and HTML pages out; the only package that imports plotting libraries.

`write_report(record, html_path)` makes a page of any record or its file, `write(result, path)` of a record, a
diagnosis or a verification. `waterfall(record)`, `bode(record)`, `frequency_response(record)` and so on make
single plotly figures; `shaft_campbell`, `critical_speed_map`, `unbalance_response` and
`sag` draw the `.dataset()` of results of `fe_shaft`. Names are imported when they are first used, and plotly with them.
"""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
