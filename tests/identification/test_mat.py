"""MATLAB files of v5 and v7.3: supported contents, and refused or unsafe ones."""

import h5py
import numpy as np
import pytest
from scipy.io import loadmat, savemat, whosmat

import identification as idn
from identification.readers.mat import variables

T = np.arange(50) / 5000
XY = np.column_stack([np.sin(T), np.cos(T)])


def v5(path, **content):
    savemat(path, content)
    return path


def v73(path, **content):
    """Write the layout of v7.3: 512 bytes of text, transposed matrices, MATLAB's class as attribute."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in content.items():
            value = np.asarray(value)
            kind = {"f": "double", "i": "int32", "u": "char"}[value.dtype.kind]
            dataset = file.create_dataset(name, data=np.atleast_2d(value).T if value.ndim == 1 else value.T)
            dataset.attrs["MATLAB_class"] = np.bytes_(kind)
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Jan  1 00:00:00 2024 HDF5 schema 1.00 .")
    return path


@pytest.mark.parametrize("write", [v5, v73])
def test_vectors_matrices_and_scalars_of_the_schema_are_read(tmp_path, write):
    path = write(tmp_path / "a.mat", time=T, disc_measured=XY, reference_x=T, reference_y=T * 2, pressure=[[3e5]])
    record = idn.read(path)
    assert record["time"].values.tolist() == T.tolist()
    assert record["disc_measured"].values.tolist() == XY.tolist()
    assert record["pressure"].values.tolist() == [3e5] * 50
    assert record.attrs["source_format"] == {v5: "MATLAB v5", v73: "MATLAB v7.3"}[write]


@pytest.mark.parametrize("write", [v5, v73])
def test_a_mapping_names_columns_of_matrices(tmp_path, write):
    path = write(tmp_path / "a.mat", probes=XY, n=np.arange(50))
    channel = {"column": "probes_2", "unit": "V", "sensitivity": "8 V/mm"}
    mapping = {"time": {"sample_rate": "5 kHz"}, "channels": {"disc_measured": {"x": channel, "y": channel}}}
    record = idn.read(path, mapping)
    assert record["disc_measured"].sel(axis="x").values == pytest.approx(XY[:, 1] / 8000)
    assert record["time"].values == pytest.approx(T)


@pytest.mark.parametrize("write", [v5, v73])
def test_a_matrix_that_lies_on_its_side_is_refused(tmp_path, write):
    with pytest.raises(idn.ReadError, match=r"'disc_measured' has shape \(2, 50\)"):
        idn.read(write(tmp_path / "a.mat", time=T, disc_measured=XY.T))


@pytest.mark.parametrize("write", [v5, v73])
def test_channels_of_different_lengths_are_refused(tmp_path, write):
    with pytest.raises(idn.ReadError, match="angle: 40 samples but 50 times"):
        idn.read(write(tmp_path / "a.mat", time=T, angle=T[:40]))


def test_cells_structs_text_and_complex_numbers_are_refused_by_name(tmp_path):
    cells = np.empty(2, object)
    cells[:] = [1.0, "a"]
    for value, sentence in (
        (cells, "'angle' is a cell array"),
        ({"x": 1.0}, "'angle' is a struct"),
        ("text", "'angle' is text"),
        (T * 1j, "'angle' holds complex values"),
    ):
        with pytest.raises(idn.ReadError, match=sentence):
            idn.read(v5(tmp_path / "a.mat", time=T, angle=value))


def test_other_variables_do_no_harm(tmp_path):
    cells = np.empty(2, object)
    cells[:] = [1.0, "a"]
    record = idn.read(v5(tmp_path / "a.mat", time=T, angle=T, config={"a": cells}, note="text", list=cells))
    assert list(record.data_vars) == ["angle"]


def element(kind, data):
    pad = -len(data) % 8
    return np.array([kind, len(data)], "<u4").tobytes() + data + b"\0" * pad


def opaque_v5(mclass):
    """Write a v5 file by hand with one variable 'angle' of a MATLAB class that scipy cannot write."""
    flags = element(6, np.array([mclass, 0], "<u4").tobytes())
    name = element(1, b"angle")
    if mclass == 17:  # opaque: no dimensions; name, type system, class, content
        body = flags + name + element(1, b"MCOS") + element(1, b"table") + inner()
    else:  # function handle: dimensions, name, content
        body = flags + element(5, np.array([1, 1], "<i4").tobytes()) + name + inner()
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    return head + np.array([14, len(body)], "<u4").tobytes() + body


def test_an_object_next_to_the_channels_does_no_harm(tmp_path):
    path = v5(tmp_path / "a.mat", time=T, angle=T)
    path.write_bytes(path.read_bytes() + opaque_v5(17).replace(b"angle", b"table")[128:])
    assert list(idn.read(path).data_vars) == ["angle"]
    assert "never opened" in idn.columns(path).others["table"]


@pytest.mark.parametrize("compressed", [False, True])
def test_own_listing_agrees_with_scipy(tmp_path, compressed):
    content = {"a": T, "long_name_of_a_vector": XY, "c": np.int8([[1]]), "s": {"x": 1}, "t": "text", "b": XY > 0}
    content |= {"u": np.zeros((2, 3, 4), np.uint16), "f": np.float32([[1, 2]])}
    savemat(tmp_path / "a.mat", content, do_compression=compressed)
    renamed = {"logical": "uint8"}
    # scipy counts the rows of a text, MATLAB its characters
    expected = [(n, (1, 4) if n == "t" else s, renamed.get(k, k)) for n, s, k in whosmat(tmp_path / "a.mat")]
    assert [(v.name, v.shape, v.kind) for v in variables(tmp_path / "a.mat")] == expected


def test_files_of_version_4_are_refused(tmp_path):
    savemat(tmp_path / "a.mat", {"time": T, "angle": T}, format="4")
    with pytest.raises(idn.ReadError, match=r"a\.mat: .*5 to 7\.3"):
        idn.read(tmp_path / "a.mat")


@pytest.mark.parametrize("dtype", ["f4", "f8", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "?"])
@pytest.mark.parametrize("compressed", [False, True])
def test_numbers_of_every_type_are_read_as_scipy_reads_them(tmp_path, dtype, compressed):
    angle = (np.arange(50) % 2 * 100).astype(dtype)
    savemat(tmp_path / "a.mat", {"time": T, "angle": angle}, do_compression=compressed)
    expected = loadmat(tmp_path / "a.mat")["angle"].ravel()
    assert idn.read(tmp_path / "a.mat")["angle"].values.tolist() == expected.astype(float).tolist()


def inner():
    flags = element(6, np.array([6, 0], "<u4").tobytes())
    size, name = element(5, np.array([1, 1], "<i4").tobytes()), element(1, b"")
    body = flags + size + name + element(9, np.array([1.0]).tobytes())
    return np.array([14, len(body)], "<u4").tobytes() + body


@pytest.mark.parametrize(
    ("mclass", "sentence"), [(17, "'angle' is a MATLAB object"), (16, "'angle' is a function handle")]
)
def test_objects_and_function_handles_are_never_opened(written, mclass, sentence):
    with pytest.raises(idn.ReadError, match=sentence):
        idn.read(written("a.mat", opaque_v5(mclass)))


def test_cells_handles_and_objects_of_v73_are_refused_by_name(tmp_path):
    for kind, attrs, sentence in (
        ("cell", {}, "'angle' is a cell array"),
        ("function_handle", {}, "'angle' is a function handle"),
        ("table", {"MATLAB_object_decode": 3}, "'angle' is a MATLAB object"),
        ("char", {}, "'angle' is text"),
    ):
        path = v73(tmp_path / "a.mat", time=T, angle=np.arange(50))
        with h5py.File(path, "r+") as file:
            file["angle"].attrs["MATLAB_class"] = np.bytes_(kind)
            file["angle"].attrs.update(attrs)
        with pytest.raises(idn.ReadError, match=sentence):
            idn.read(path)


def test_references_and_structs_of_v73_are_not_followed(tmp_path):
    path = v73(tmp_path / "a.mat", time=T)
    with h5py.File(path, "r+") as file:
        file.create_group("#refs#").create_dataset("a", data=T)
        file.create_dataset("angle", data=np.array([file["#refs#/a"].ref] * 50, dtype=h5py.ref_dtype))
        file.create_group("speed").create_dataset("x", data=T)
    with pytest.raises(idn.ReadError, match="'angle' is a MATLAB object"):
        idn.read(path)
    with h5py.File(path, "r+") as file:
        del file["angle"]
    with pytest.raises(idn.ReadError, match="'speed' is a struct"):
        idn.read(path)


def test_a_v73_file_leads_nowhere_outside_itself(tmp_path):
    secret = tmp_path / "secret"
    secret.write_bytes(T.tobytes())
    for add, sentence in (
        (lambda f: f.__setitem__("angle", h5py.ExternalLink(str(secret), "/a")), "'angle' is a link"),
        (lambda f: f.__setitem__("angle", h5py.SoftLink("/time")), "'angle' is a link"),
        (lambda f: f.create_dataset("angle", (50,), "f8", external=[(str(secret), 0, 400)]), "'angle'"),
        (lambda f: f.create_dataset("angle", (10**12,), "f8", chunks=(1000,)), "memory"),
    ):
        path = v73(tmp_path / "a.mat", time=T)
        with h5py.File(path, "r+") as file:
            add(file)
        with pytest.raises(idn.ReadError, match=sentence):
            idn.read(path)


@pytest.mark.parametrize("write", [v5, v73])
@pytest.mark.parametrize("cut", [20, 150, 0.3, 0.6, 0.95])
def test_a_file_that_was_cut_off_is_refused(tmp_path, write, cut):
    path = write(tmp_path / "a.mat", time=T, disc_measured=XY, angle=T)
    content = path.read_bytes()
    path.write_bytes(content[: cut if cut > 1 else int(len(content) * cut)])
    with pytest.raises(idn.ReadError, match=r"\.mat"):
        idn.read(path)


def test_noise_under_the_name_of_a_mat_file_is_refused(written):
    for seed in range(20):
        noise = np.random.default_rng(seed).bytes(3000)
        for head in (b"", b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"):
            with pytest.raises(idn.ReadError):
                idn.read(written("a.mat", head + noise))


def test_a_matrix_larger_than_its_file_is_refused(tmp_path):
    path = v5(tmp_path / "a.mat", angle=np.zeros((50, 1)))
    content = path.read_bytes()
    huge = np.array([2_000_000_000, 1], "<i4").tobytes()
    path.write_bytes(content.replace(np.array([50, 1], "<i4").tobytes(), huge, 1))
    with pytest.raises(idn.ReadError, match="2000000000 values"):
        idn.read(path)
