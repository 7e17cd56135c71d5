"""Universal files, dataset 58: ASCII and binary, refusals, oversized counts."""

import numpy as np
import pytest

import identification as idn

N = 7
X = np.array([0.0, 1.5, -2.25, 3.0, -4.5e-3, 5.0, 6.125])


def header(title, node=1, direction=1, *, form=4, n=N, even=1, function=1, unit="m", abscissa=17, step=2e-4):
    """Write the eleven records that come before the values."""
    label = f"{abscissa:10d}{0:5d}{0:5d}{0:5d} {'Time':20s} {'s':20s}"
    value = f"{8:10d}{0:5d}{0:5d}{0:5d} {'Displacement':20s} {unit:20s}"
    none = f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}"
    freedom = f"{function:5d}{1:10d}{0:5d}{0:10d} {'NONE':10s}{node:10d}{direction:4d} {'NONE':10s}{0:10d}{0:4d}"
    kind = f"{form:10d}{n:10d}{even:10d}{0.0:13.5e}{step:13.5e}{0.0:13.5e}"
    return "\n".join(
        [f"{title:80s}", "NONE", "01-JAN-24 00:00:00", "NONE", "NONE", freedom, kind, label, value, none, none]
    )


def lines(fields, per_line):
    rows = (fields[i : i + per_line] for i in range(0, len(fields), per_line))
    return "\n".join("".join(row) for row in rows)


def ascii58(title, values=X, *, form=4, even=1, **more):
    if even:
        fields = [f"{v:13.5e}" if form == 2 else f"{v:20.12e}" for v in values]
    else:
        width = (lambda v: f"{v:13.5e}") if form == 2 else (lambda v: f"{v:20.12e}")
        fields = [text for i, v in enumerate(values) for text in (f"{i * 2e-4:13.5e}", width(v))]
    per_line = {2: 6, 4: 4}[form]
    text = f"    -1\n    58\n{header(title, form=form, even=even, **more)}\n{lines(fields, per_line)}\n    -1\n"
    return text.encode()


def binary58(title, values=X, *, form=4, order=1, size=None, **more):
    data = np.asarray(values).astype(("<" if order == 1 else ">") + ("f4" if form == 2 else "f8")).tobytes()
    size = len(data) if size is None else size
    kind = f"    58b{order:6d}{2:6d}{11:12d}{size:12d}{0:6d}{0:6d}{0:12d}{0:12d}"
    return f"    -1\n{kind}\n{header(title, form=form, **more)}\n".encode() + data + b"\n    -1\n"


def pair(write, **more):
    return write("disc_measured_x", **more) + write("disc_measured_y", node=2, direction=-2, **more)


@pytest.mark.parametrize("form", [2, 4])
@pytest.mark.parametrize("even", [0, 1])
def test_text_by_the_published_format_is_read(written, form, even):
    record = idn.read(written("a.uff", pair(ascii58, form=form, even=even)))
    assert record["disc_measured"].sel(axis="x").values == pytest.approx(X, rel=1e-5 if form == 2 else 1e-12)
    assert record["time"].values == pytest.approx(np.arange(N) * 2e-4, rel=1e-5)
    assert record.attrs["source_format"] == "UFF 58"


@pytest.mark.parametrize("form", [2, 4])
@pytest.mark.parametrize("order", [1, 2])
def test_binary_of_both_byte_orders_is_read(written, form, order):
    record = idn.read(written("a.uff", pair(binary58, form=form, order=order)))
    assert record["disc_measured"].sel(axis="y").values.tolist() == X.astype("f4" if form == 2 else "f8").tolist()


def test_numbers_that_touch_are_separated_by_their_columns(written):
    record = idn.read(written("a.unv", pair(ascii58, values=-np.abs(X) - 1, form=2)))
    assert record["disc_measured"].sel(axis="x").values == pytest.approx(-np.abs(X) - 1, rel=1e-5)


def test_units_come_from_the_ordinate_and_other_datasets_are_passed_over(written):
    other = b"    -1\n    15\n         1         0\n    -1\n"
    record = idn.read(written("a.uff", other + pair(ascii58, unit="um") + ascii58("spectrum", function=2) + other))
    assert record["disc_measured"].sel(axis="x").values == pytest.approx(X * 1e-6)


def test_lines_may_end_as_on_windows(written):
    record = idn.read(written("a.uff", pair(ascii58).replace(b"\n", b"\r\n")))
    assert record["disc_measured"].sel(axis="y").values == pytest.approx(X, rel=1e-12)


def test_a_mapping_goes_by_node_and_direction(written):
    path = written("a.uff", ascii58("NONE", node=12) + ascii58("NONE", node=12, direction=-2, unit="NONE"))
    channel = {"x": {"column": "12:+X"}, "y": {"column": "12:-Y", "unit": "um"}}
    record = idn.read(path, {"channels": {"disc_measured": channel}})
    assert record["disc_measured"].sel(axis="y").values == pytest.approx(X * 1e-6)


GOOD = pair(ascii58)
BINARY = pair(binary58)
BAD = {
    "cut in the values": (GOOD[:-300], "does not end with -1; the file was cut off"),
    "cut in the header": (GOOD[:400], "does not end with -1"),
    "cut binary": (BINARY[:-30], "declares 56 bytes but the file has"),
    "binary end": (BINARY[:-8], "does not end with -1"),
    "huge binary": (binary58("angle", size=10**11), "declares 100000000000 bytes but the file has"),
    "huge count": (ascii58("angle", n=2_000_000_000), "dataset 1 (58): declares 2000000000 samples but holds 7"),
    "negative count": (ascii58("angle", n=-5), "declares -5 samples but holds 7"),
    "negative bytes": (binary58("angle", size=-100), "declares -100 bytes"),
    "fewer values": (ascii58("angle", n=9), "declares 9 samples but holds 7; copy the file again"),
    "complex": (
        ascii58("angle").replace(b"         4         7", b"         6         7"),
        "values of type 6; export real",
    ),
    "response function": (ascii58("angle", function=4), "holds functions of type 4 and no time response"),
    "frequency": (ascii58("angle", abscissa=18), "has an abscissa other than time"),
    "nothing": (b"    -1\n    15\n    -1\n", "holds no time response in a dataset 58"),
    "two clocks": (ascii58("disc_x") + ascii58("disc_y", step=1e-4), "is sampled every"),
    "word": (ascii58("angle").replace(b"1.5000", b"=cmd()"), "holds what is not a number"),
    "long line": (ascii58("angle").replace(b"\n    -1\n", b"9" * 100 + b"\n    -1\n"), "longer than its format"),
    "rubbish between": (GOOD + b"rubbish\n", "where a dataset begins with -1"),
    "units": (
        b"    -1\n   164\n         5mm (milli-newton)\n    -1\n" + GOOD,
        "of unit system 5 (dataset 164)' is not a known unit of length",
    ),
    "number format": (BINARY.replace(b"58b     1     2", b"58b     1     1"), "byte order 1 and number format 1"),
    "count is no number": (GOOD.replace(b"         4         7", b"         4       abc"), "not a whole number"),
    "unknown unit": (pair(ascii58, unit="ells"), "unit 'ells' is not a known unit of length"),
    "NaN": (ascii58("angle", values=[*X[:6], np.nan], unit="rad"), "record.angle: 1 NaN or infinite values"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_universal_file_is_answered_with_one_sentence(written, case):
    content, sentence = BAD[case]
    path = written("a.uff", content)
    with pytest.raises((idn.ReadError, idn.SchemaError)) as caught:
        idn.read(path)
    assert sentence in str(caught.value) and "\n" not in str(caught.value)


def test_any_cut_is_refused(written):
    for content in (GOOD, BINARY):
        for cut in range(10, len(content) - 2, 97):
            with pytest.raises((idn.ReadError, idn.SchemaError)):
                idn.read(written("a.uff", content[:cut]))
