import os
import warnings

import numpy as np
import pytest

from evaluation.base import InputError, from_xyz, xyz
from evaluation.clouds import is_cloud, read_blocks, read_cloud

RNG = np.random.default_rng(11)
POINTS = RNG.normal(scale=40.0, size=(500, 3)).astype(np.float32)


def write_pcd(path, header, data):
    lines = "".join(f"{key} {value}\n" for key, value in header.items())
    path.write_bytes(b"# .PCD v0.7\n" + lines.encode() + data)


HEADER = {
    "VERSION": "0.7",
    "FIELDS": "x y z",
    "SIZE": "4 4 4",
    "TYPE": "F F F",
    "COUNT": "1 1 1",
    "WIDTH": 500,
    "HEIGHT": 1,
    "VIEWPOINT": "0 0 0 1 0 0 0",
    "POINTS": 500,
}
ONE = {"WIDTH": 1, "POINTS": 1}
HUGE = {"WIDTH": 10**15, "POINTS": 10**15}


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("ascii_", [False, True])
@pytest.mark.parametrize("kind", ["pcd", "ply"])
def test_files_of_open3d(tmp_path, kind, ascii_, compressed):
    o3d = pytest.importorskip("open3d")
    # Repeated coordinates, so that compression finds something to copy.
    points = np.repeat(POINTS.astype(np.float64), 3, axis=0)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.colors = o3d.utility.Vector3dVector(np.full((1500, 3), 0.5))
    path = tmp_path / f"map.{kind}"
    assert o3d.io.write_point_cloud(
        str(path), cloud, write_ascii=ascii_, compressed=compressed
    )
    # Open3D writes six digits as text.
    np.testing.assert_allclose(xyz(read_cloud(path)), points, rtol=1e-5)


def test_text_keeps_all_digits_of_whole_numbers(tmp_path):
    header = {
        "FIELDS": "x y z t n",
        "SIZE": "4 4 4 8 8",
        "TYPE": "F F F U I",
        "COUNT": "1 1 1 1 2",
        "DATA": "ascii",
    }
    path = tmp_path / "times.pcd"
    numbers = 2**64 - 1, 2**53 + 1, -(2**63) + 1
    row = "1 2 3.5 {} {} {}\n".format(*numbers)
    write_pcd(path, HEADER | ONE | header, row.encode())
    cloud = read_cloud(path)
    assert (cloud["t"].tolist(), cloud["n"].tolist()) == (
        [numbers[0]],
        [[*numbers[1:]]],
    )
    assert xyz(cloud).tolist() == [[1.0, 2.0, 3.5]]
    # A writer of floats.
    write_pcd(path, HEADER | ONE | header, b"1 2 3.5 17.0 5 6e0\n")
    assert read_cloud(path)["t"].tolist() == [17]


def test_pcd_with_padding_doubles_and_arrays(tmp_path):
    dtype = np.dtype(
        [
            ("intensity", "<u2"),
            ("pad", "u1", 3),
            ("x", "<f8"),
            ("y", "<f8"),
            ("z", "<f4"),
            ("normal", "<f4", 3),
        ]
    )
    records = np.zeros(3, dtype=dtype)
    records["x"] = [1e6 + 0.125, -2.0, np.nan]
    records["z"] = [1.5, 2.5, 3.5]
    records["normal"] = [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    header = HEADER | {
        # PCL also writes padding of no bytes.
        "FIELDS": "intensity _ x y z _ normal",
        "SIZE": "2 1 8 8 4 1 4",
        "TYPE": "U U F F F U F",
        "COUNT": "1 3 1 1 1 0 3",
        "POINTS": 3,
        "WIDTH": 3,
    }
    path = tmp_path / "a.pcd"
    write_pcd(path, header | {"DATA": "binary"}, records.tobytes())
    cloud = read_cloud(path)
    np.testing.assert_array_equal(cloud["x"], records["x"])
    np.testing.assert_array_equal(cloud["z"], records["z"])
    text = b"7 0 0 0 1000000.125 0 1.5 1 2 3\n8 0 0 0 -2 0 2.5 4 5 6\n"
    text += b"9 0 0 0 nan 0 3.5 7 8 9\n"
    write_pcd(path, header | {"DATA": "ascii"}, text)
    cloud = read_cloud(path)
    np.testing.assert_array_equal(cloud["x"], records["x"])
    np.testing.assert_array_equal(cloud["normal"], records["normal"])
    np.testing.assert_array_equal(cloud["intensity"], [7, 8, 9])


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_ply_with_doubles_and_faces(tmp_path, order):
    dtype = np.dtype([("x", "f8"), ("y", "f8"), ("z", "f8"), ("red", "u1")])
    records = np.zeros(3, dtype=dtype.newbyteorder(order))
    records["y"] = [1e6 + 0.125, 2.0, -3.0]
    name = "little" if order == "<" else "big"
    header = (
        f"ply\nformat binary_{name}_endian 1.0\ncomment hello\n"
        "element vertex 3\nproperty double x\nproperty double y\n"
        "property double z\nproperty uchar red\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    path = tmp_path / "a.ply"
    path.write_bytes(header.encode() + records.tobytes() + bytes(13))
    np.testing.assert_array_equal(read_cloud(path)["y"], records["y"])


@pytest.mark.parametrize("dtype", ["<f4", "<f8", ">f4", "<i4"])
@pytest.mark.parametrize("columns", [3, 4])
@pytest.mark.parametrize("order", ["C", "F"])
def test_npy(tmp_path, dtype, columns, order):
    values = np.arange(20.0 * columns).reshape(20, columns)
    np.save(tmp_path / "a.npy", np.asarray(values, dtype=dtype, order=order))
    cloud = read_cloud(tmp_path / "a.npy")
    np.testing.assert_array_equal(xyz(cloud), values[:, :3])
    assert ("intensity" in cloud.dtype.names) == (columns == 4)


def test_structured_npy(tmp_path):
    cloud = from_xyz(POINTS)
    np.save(tmp_path / "a.npy", cloud)
    np.testing.assert_array_equal(xyz(read_cloud(tmp_path / "a.npy")), POINTS)


def test_bin(tmp_path):
    values = np.c_[POINTS, np.full(500, 0.5, dtype=np.float32)]
    values.tofile(tmp_path / "a.bin")
    cloud = read_cloud(tmp_path / "a.bin")
    np.testing.assert_array_equal(xyz(cloud), POINTS)
    assert (cloud["intensity"] == 0.5).all()


def test_empty_clouds(tmp_path):
    np.save(tmp_path / "a.npy", np.empty((0, 3)))
    (tmp_path / "a.bin").write_bytes(b"")
    empty = HEADER | {"POINTS": 0, "WIDTH": 0}
    write_pcd(tmp_path / "a.pcd", empty | {"DATA": "binary"}, b"")
    write_pcd(tmp_path / "b.pcd", empty | {"DATA": "ascii"}, b"")
    (tmp_path / "a.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\n"
        "property float y\nproperty float z\nend_header\n"
    )
    for name in ("a.npy", "a.bin", "a.pcd", "b.pcd", "a.ply"):
        assert xyz(read_cloud(tmp_path / name)).shape == (0, 3)


def faulty_files(folder):
    """Yields name, content, and expected text of the error."""
    yield "short.bin", bytes(17), "17 bytes is not a whole number"
    yield "text.npy", b"hello", "npy|pickle|magic"
    yield "text.pcd", b"hello\n", "no DATA line"
    yield "text.ply", b"hello\n", "not a PLY file"
    yield "open.ply", b"ply\nformat ascii 1.0\n", "no end_header"
    np.save(folder / "flat.npy", np.zeros(9))
    yield "flat.npy", None, "instead of N x 3"
    np.save(folder / "wide.npy", np.zeros((3, 7)))
    yield "wide.npy", None, "instead of N x 3"
    np.save(folder / "words.npy", np.full((3, 3), "a"))
    yield "words.npy", None, "not a type of coordinates"
    np.save(folder / "cut.npy", np.zeros((100, 3)))
    yield "cut.npy", (folder / "cut.npy").read_bytes()[:-8], "."
    pcds = {
        "cut.pcd": ({"DATA": "binary"}, bytes(5999), "cut off"),
        "cut_ascii.pcd": (
            {"DATA": "ascii"},
            b"1 2 3\n" * 499,
            "499 instead of 500 rows",
        ),
        "large.pcd": (ONE | {"DATA": "ascii"}, b"1 2 1e39", "z: a num"),
        "huge.pcd": (HUGE | {"DATA": "ascii"}, b"1 2 3", "cut off"),
        "words.pcd": (
            {"DATA": "ascii"},
            b"a b c\n" * 500,
            "row 1: could not convert 'a'",
        ),
        "odd.pcd": ({"DATA": "zip"}, b"", "unknown PCD encoding"),
        "fields.pcd": ({"SIZE": "4 4", "DATA": "binary"}, b"", "differ"),
        "no_z.pcd": ({"FIELDS": "x y w", "DATA": "binary"}, b"", "field z"),
        "ints.pcd": ({"TYPE": "I F F", "DATA": "binary"}, b"", "field x"),
        "packed.pcd": (
            {"DATA": "binary_compressed"},
            np.array([70, 6000], dtype="<u4").tobytes() + b"\xff" * 70,
            "damaged",
        ),
        "packed_cut.pcd": (
            {"DATA": "binary_compressed"},
            np.array([70, 6000], dtype="<u4").tobytes(),
            "cut off",
        ),
        "ring.pcd": (
            ONE
            | {
                "FIELDS": "x y z r",
                "SIZE": "4 4 4 1",
                "TYPE": "F F F U",
                "COUNT": "1 1 1 1",
                "DATA": "ascii",
            },
            b"1 2 3 256\n",
            "r: a number does not fit uint8",
        ),
        "packed_size.pcd": (
            {"DATA": "binary_compressed"},
            np.array([1, 7], dtype="<u4").tobytes() + b"a",
            "does not fit",
        ),
    }
    for name, (changes, data, fault) in pcds.items():
        write_pcd(folder / name, HEADER | changes, data)
        yield name, None, fault
    header = b"ply\nformat %b 1.0\nelement vertex 2\nproperty float x\n"
    header += b"property float y\nproperty %b z\nend_header\n"
    yield (
        "cut.ply",
        header % (b"binary_little_endian", b"float") + bytes(23),
        "cut off",
    )
    yield (
        "huge.ply",
        (header % (b"ascii", b"float")).replace(b"2", b"9" * 15),
        "cut off",
    )
    yield (
        "negative.ply",
        (header % (b"ascii", b"float")).replace(b"2", b"-2"),
        "negative number",
    )
    yield (
        "cut_ascii.ply",
        header % (b"ascii", b"float") + b"1 2 3",
        "1 instead of 2 rows",
    )
    yield "odd.ply", header % (b"binary", b"float"), "unknown format"


def test_faults_are_one_line_that_names_the_file(tmp_path):
    for name, content, fault in faulty_files(tmp_path):
        path = tmp_path / name
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(InputError, match=f"^{path}: .*({fault})") as info:
            read_cloud(path)
        assert "\n" not in str(info.value)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"'descr': '<f4'", b"'descr': '<f4"),
        (b"(500, 3)", b"(500, -3)"),
        (b"'shape'", b"7      "),
    ],
)
def test_damaged_npy_headers(tmp_path, old, new):
    path = tmp_path / "map.npy"
    np.save(path, POINTS)
    data = path.read_bytes()
    assert old in data
    path.write_bytes(data.replace(old, new.ljust(len(old))))
    with pytest.raises(InputError, match=r"map.npy: "):
        read_cloud(path)


@pytest.mark.parametrize("digits", [9, 15])
def test_a_number_of_points_that_numpy_cannot_count(tmp_path, digits):
    """It is refused without a warning beside the error."""
    path = tmp_path / "map.npy"
    header = "{'descr': '<f8', 'fortran_order': False, 'shape': "
    header += f"({10**digits}, {10**digits})}}".ljust(245 - len(header)) + "\n"
    path.write_bytes(b"\x93NUMPY\x01\x00\xf6\x00" + header.encode())
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        with pytest.raises(InputError, match=r"map\.npy: "):
            read_cloud(path)
    assert not told


def test_archives_and_records_of_no_numbers(tmp_path):
    np.savez(tmp_path / "a.npz", POINTS)
    (tmp_path / "a.npz").rename(tmp_path / "a.npy")
    with pytest.raises(InputError, match="an archive"):
        read_cloud(tmp_path / "a.npy")
    np.save(tmp_path / "b.npy", np.zeros(3, [(n, "S4") for n in "xyz"]))
    with pytest.raises(InputError, match="no number x"):
        read_cloud(tmp_path / "b.npy")


@pytest.mark.parametrize(("z", "fine"), [(9.9e7, True), (1.01e8, False)])
def test_coordinates_out_of_this_world(tmp_path, z, fine):
    points = np.zeros((3, 3))
    points[1] = np.nan, np.inf, z
    np.save(tmp_path / "map.npy", points)
    if fine:
        assert len(read_cloud(tmp_path / "map.npy")) == 3
        return
    with pytest.raises(InputError, match=r"z: point 1 is at 1.01e\+08 m"):
        read_cloud(tmp_path / "map.npy")


def test_unknown_or_missing_files(tmp_path):
    with pytest.raises(InputError, match="unknown kind of point cloud"):
        read_cloud(tmp_path / "a.las")
    with pytest.raises(InputError, match="No such file"):
        read_cloud(tmp_path / "a.pcd")
    assert is_cloud(tmp_path / "A.PCD")
    assert not is_cloud(tmp_path / "a.txt")


def write_clouds(folder):
    """Yields paths of a cloud in every kind of file, 500 points in each."""
    for encoding, data in (
        ("binary", POINTS.tobytes()),
        ("ascii", b"1 2 3\n" * 500),
    ):
        path = folder / f"{encoding}.pcd"
        write_pcd(path, HEADER | {"DATA": encoding}, data)
        yield path
    for name, data in (
        ("ascii", b"1 2 3\n" * 500),
        ("binary_little_endian", POINTS.tobytes()),
    ):
        header = f"ply\nformat {name} 1.0\nelement vertex 500\n"
        header += "".join(f"property float {axis}\n" for axis in "xyz")
        path = folder / f"{name}.ply"
        path.write_bytes(header.encode() + b"end_header\n" + data)
        yield path
    path = folder / "points.bin"
    path.write_bytes(np.zeros((500, 4), "<f4").tobytes())
    yield path
    for name, values in (
        ("rows", POINTS),
        ("columns", np.asfortranarray(POINTS)),
        ("records", from_xyz(POINTS)),
    ):
        np.save(folder / f"{name}.npy", values)
        yield folder / f"{name}.npy"


def test_blocks_are_parts_of_the_whole(tmp_path):
    for path in write_clouds(tmp_path):
        parts = list(read_blocks(path, block=70))
        assert [len(part) for part in parts] == [70] * 7 + [10]
        whole = read_cloud(path)
        np.testing.assert_array_equal(np.concatenate(parts), whole)
        assert len(whole) == 500


def test_a_file_that_is_cut_while_it_is_read(tmp_path):
    for path in write_clouds(tmp_path):
        size = path.stat().st_size
        parts = read_blocks(path, block=10)
        next(parts)
        # A buffered stream has read some of the following bytes.
        os.truncate(path, size // 10)
        with pytest.raises(InputError, match=f"^{path}: .*(cut off|instead)"):
            list(parts) and list(read_blocks(path))


def test_more_than_the_header_says(tmp_path):
    for path in write_clouds(tmp_path):
        if path.suffix == ".bin":
            continue
        is_text = path.stem == "ascii"
        with open(path, "ab") as stream:
            stream.write(b"7 8 9\n" if is_text else bytes(12))
        with pytest.raises(InputError, match=f"^{path}: .*more than the"):
            read_cloud(path)


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"WIDTH": 400}, "POINTS 500 against 400"),
        ({"HEIGHT": 2}, "POINTS 500 against 1000"),
        ({"POINTS": 499}, "POINTS 499 against 500"),
    ],
)
def test_two_numbers_of_points(tmp_path, changes, fault):
    path = tmp_path / "a.pcd"
    header = HEADER | changes | {"DATA": "binary"}
    write_pcd(path, header, POINTS.tobytes())
    with pytest.raises(InputError, match=f"^{path}: PCD header: {fault}"):
        read_cloud(path)


def test_plain_points_in_a_compressed_file(tmp_path):
    """pypcd4 writes what LZF does not make smaller as it is."""
    path = tmp_path / "a.pcd"
    points = np.random.default_rng(1).normal(size=(500, 3)).astype("<f4")
    sizes = np.array([points.nbytes, points.nbytes], "<u4").tobytes()
    header = HEADER | {"DATA": "binary_compressed"}
    write_pcd(path, header, sizes + points.T.tobytes())
    np.testing.assert_array_equal(xyz(read_cloud(path)), points)


def test_a_scan_of_many_gigabytes(tmp_path):
    path = tmp_path / "a.bin"
    path.touch()
    os.truncate(path, 16 << 32)
    with pytest.raises(InputError, match="takes more memory"):
        read_cloud(path)
    assert len(next(read_blocks(path))) < 1_000_000


def test_files_that_are_none(tmp_path):
    path = tmp_path / "a.bin"
    os.mkfifo(path)
    with pytest.raises(InputError, match=f"^{path}: not a regular file"):
        read_cloud(path)
    (tmp_path / "b.bin").symlink_to("/dev/zero")
    with pytest.raises(InputError, match="not a regular file"):
        list(read_blocks(tmp_path / "b.bin"))


def test_odd_floats_without_a_word(tmp_path):
    """Half precision, which ends at 65504, and signalling NaN."""
    np.save(tmp_path / "half.npy", np.array([[1, 2, 3], [np.inf, 0, 0]], "f2"))
    signalling = np.zeros((4, 3), "<f4")
    signalling.view("<u4")[1] = 0x7F800001
    np.save(tmp_path / "signalling.npy", signalling)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name, finite in (("half", 1), ("signalling", 3)):
            points = xyz(read_cloud(tmp_path / f"{name}.npy"))
            assert np.isfinite(points).all(axis=1).sum() == finite


def notes_of(path):
    notes = []
    cloud = read_cloud(path, on_note=notes.append)
    return cloud, notes


@pytest.mark.parametrize(
    ("viewpoint", "is_told"),
    [
        (None, False),
        ("0 0 0 1 0 0 0", False),
        ("30 5 0 0.7071 0 0 0.7071", True),
        ("0 0 0 1", True),
        ("a b c 1 0 0 0", True),
    ],
)
def test_a_viewpoint_is_named(tmp_path, viewpoint, is_told):
    header = {k: v for k, v in HEADER.items() if k != "VIEWPOINT"}
    if viewpoint is not None:
        header["VIEWPOINT"] = viewpoint
    path = tmp_path / "a.pcd"
    write_pcd(path, header | {"DATA": "binary"}, POINTS.tobytes())
    cloud, notes = notes_of(path)
    np.testing.assert_array_equal(xyz(cloud), POINTS)
    assert [f"{path}: VIEWPOINT is not applied" in n for n in notes] == (
        [True] * is_told
    )


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"SIZE": "3 4 4"}, "x: no type F of SIZE 3"),
        ({"TYPE": "U F F", "SIZE": "3 4 4"}, "x: no type U of SIZE 3"),
        ({"TYPE": "D F F"}, "x: no type D of SIZE 4"),
        ({"COUNT": "0 1 1"}, "no field x of type F"),
        ({"COUNT": "-1 1 1"}, "COUNT -1"),
        ({"COUNT": "one 1 1"}, "COUNT is missing or wrong"),
        ({"FIELDS": "x y y"}, "field y is there twice"),
        ({"POINTS": "many"}, "POINTS is missing or wrong"),
        ({"SIZE": ""}, "FIELDS, SIZE, TYPE and COUNT differ"),
    ],
)
def test_faults_of_pcd_headers_are_in_our_words(tmp_path, changes, fault):
    path = tmp_path / "a.pcd"
    write_pcd(path, HEADER | changes | {"DATA": "binary"}, POINTS.tobytes())
    with pytest.raises(InputError, match=f"^{path}: PCD header: .*{fault}"):
        read_cloud(path)


def test_rows_of_another_length_are_named(tmp_path):
    path = tmp_path / "a.pcd"
    text = b"1 2 3\n" * 30 + b"1 2\n" + b"1 2 3\n" * 469
    write_pcd(path, HEADER | {"DATA": "ascii"}, text)
    with pytest.raises(InputError, match=r": row 31: 2 columns instead of 3$"):
        read_cloud(path)


PLY_XYZ = b"property %s x\nproperty %s y\nproperty %s z\n"


def ply(encoding, *elements, data=b""):
    lines = [b"ply", b"format %s 1.0" % encoding]
    for name, count, properties in elements:
        lines += [b"element %s %d" % (name, count), properties.strip()]
    return b"\n".join([*lines, b"end_header", b""]) + data


FLOATS = PLY_XYZ % ((b"float",) * 3)
CAMERA = (b"camera", 2, b"property float fx\nproperty uchar id")


@pytest.mark.parametrize("end", ["<", ">"])
def test_elements_before_the_vertices(tmp_path, end):
    name = b"binary_little_endian" if end == "<" else b"binary_big_endian"
    data = bytes(10) + POINTS.astype(f"{end}f4").tobytes()
    path = tmp_path / "a.ply"
    path.write_bytes(ply(name, CAMERA, (b"vertex", 500, FLOATS), data=data))
    np.testing.assert_array_equal(xyz(read_cloud(path)), POINTS)
    text = b"9 1\n8 2\n1 2 3\n4 5 6\n"
    path.write_bytes(ply(b"ascii", CAMERA, (b"vertex", 2, FLOATS), data=text))
    assert xyz(read_cloud(path)).tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize(
    ("elements", "fault"),
    [
        (
            [(b"vertex", 1, FLOATS + b"property list uchar int ring\n")],
            "vertex: property ring of the type 'list'",
        ),
        (
            [
                (b"face", 1, b"property list uchar int corners\n"),
                (b"vertex", 1, FLOATS),
            ],
            "face: property corners of the type 'list'",
        ),
        ([(b"vertex", 1, FLOATS + b"property half w\n")], "'half'"),
        ([(b"vertex", 1, FLOATS + b"property int x\n")], "x is there twice"),
        ([(b"vertex", 1, PLY_XYZ % ((b"int",) * 3))], "property x"),
        ([(b"point", 1, FLOATS)], "no element vertex"),
        ([(b"vertex", 1, b"property float\n")], "'property float' is not"),
    ],
)
def test_ply_that_is_not_read(tmp_path, elements, fault):
    path = tmp_path / "a.ply"
    path.write_bytes(ply(b"binary_little_endian", *elements, data=bytes(99)))
    with pytest.raises(InputError, match=f"^{path}: PLY header: .*{fault}"):
        read_cloud(path)


def test_marks_and_line_ends_of_headers(tmp_path):
    path = tmp_path / "a.ply"
    text = ply(b"ascii", (b"vertex", 1, FLOATS), data=b"1 2 3\n")
    path.write_bytes(b"\xef\xbb\xbf" + text.replace(b"\n", b"\r\n"))
    assert xyz(read_cloud(path)).tolist() == [[1, 2, 3]]
    path = tmp_path / "a.pcd"
    write_pcd(path, HEADER | ONE | {"DATA": "ascii"}, b"1 2 3\n")
    text = path.read_bytes().removeprefix(b"# .PCD v0.7\n")
    path.write_bytes(b"\xef\xbb\xbf" + text.replace(b"\n", b"\r\n"))
    assert xyz(read_cloud(path)).tolist() == [[1, 2, 3]]


@pytest.mark.parametrize(
    ("kind", "northing", "step"),
    [
        ("<f4", 4.02e6, "0.25"),
        ("<f4", 262_144.0, "0.031"),
        ("<f4", 262_143.0, None),
        ("<f8", 4.02e6, None),
    ],
)
def test_coordinates_too_far_for_single_precision(
    tmp_path, kind, northing, step
):
    points = np.zeros((9, 3), kind)
    points[4, 1] = northing
    points[5] = np.nan
    np.save(tmp_path / "a.npy", points)
    _, notes = notes_of(tmp_path / "a.npy")
    assert len(notes) == (step is not None)
    assert step is None or f"steps of {step} m" in notes[0]
