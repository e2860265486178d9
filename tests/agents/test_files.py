"""Files that appear whole or not at all, with the umask's mode, and errors that name them."""

import errno
import os
import re

import numpy as np
import pytest

from agents.files import (
    check_space,
    check_writable,
    copy_whole,
    read_arrays,
    read_json,
    write_csv,
    write_folder,
    write_json,
    write_text,
    write_whole,
)


def modes(folder):
    return {path.name: path.stat().st_mode & 0o777 for path in folder.iterdir()}


@pytest.mark.parametrize("umask", [0o022, 0o077, 0o002])
def test_mode_is_that_of_any_new_file_and_folder(tmp_path, umask):
    before = os.umask(umask)
    try:
        write_text(tmp_path / "text", "a")
        write_folder(tmp_path / "folder", lambda folder: (folder / "inside").write_text("a"))
        copy_whole(tmp_path / "text", tmp_path / "copy")
    finally:
        os.umask(before)
    assert modes(tmp_path) == {"text": 0o666 & ~umask, "copy": 0o666 & ~umask, "folder": 0o777 & ~umask}


def test_file_is_written_where_its_mode_may_not_be_changed(tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr("os.chmod", refuse)
    assert write_text(tmp_path / "text", "a").read_text() == "a"


def test_content_is_on_the_disk_before_it_has_its_name(tmp_path, monkeypatch):
    done, fsync, replace = [], os.fsync, os.replace

    def synced(handle):
        done.append(os.path.basename(os.readlink(f"/proc/self/fd/{handle}")))
        fsync(handle)

    def renamed(source, target):
        done.append("rename")
        replace(source, target)

    monkeypatch.setattr("os.fsync", synced)
    monkeypatch.setattr("os.replace", renamed)
    write_text(tmp_path / "a.txt", "a")
    assert re.fullmatch(r"\.a-\w{8}\.txt rename " + tmp_path.name, " ".join(done))
    done.clear()
    write_folder(tmp_path / "b", lambda folder: (folder / "inside").write_text("a"))
    assert re.fullmatch(r"inside \.b-\w{8} rename " + tmp_path.name, " ".join(done))


@pytest.mark.parametrize("write", [write_whole, write_folder])
def test_write_that_fails_leaves_what_was_there_and_names_it(tmp_path, write):
    (tmp_path / "kept").mkdir() if write is write_folder else (tmp_path / "kept").write_text("old")

    def full(_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match="No space left on device") as failed:
        write(tmp_path / "kept", full)
    assert failed.value.filename == str(tmp_path / "kept")
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]


def test_folder_that_cannot_be_written_and_disk_without_room_are_named(tmp_path):
    check_writable(tmp_path / "new" / "folder")
    assert list((tmp_path / "new" / "folder").iterdir()) == []
    (tmp_path / "file").write_text("")
    with pytest.raises(NotADirectoryError, match="file/inside"):
        check_writable(tmp_path / "file" / "inside")
    check_space(tmp_path / "new" / "not" / "yet", 0)
    with pytest.raises(OSError, match=rf"No space left on device: 1000000000000 MB are needed, .* free: '{tmp_path}'"):
        check_space(tmp_path, 10**18)


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write anywhere")
def test_folder_without_permission_is_named(tmp_path):
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(PermissionError, match=str(tmp_path)):
            check_writable(tmp_path)
    finally:
        tmp_path.chmod(0o700)


def test_written_values_come_back(tmp_path):
    assert read_json(write_json(tmp_path / "a.json", {"a": [1, 2.5]})) == {"a": [1, 2.5]}
    assert write_csv(tmp_path / "a.csv", ["x", "y"], [(1, 2)]).read_text() == "x,y\n1,2\n"
    arrays = {"a": np.arange(3.0), "b/c": np.array(True)}
    write_whole(tmp_path / "a.npz", lambda temporary: np.savez(temporary, **arrays))
    back = read_arrays(tmp_path / "a.npz")
    assert list(back) == list(arrays)
    for name, array in arrays.items():
        np.testing.assert_array_equal(back[name], array)


def test_damaged_arrays_are_refused_by_name_and_missing_ones_are_missing(tmp_path):
    for content in (b"", b"PK", b"no zip"):
        (tmp_path / "a.npz").write_bytes(content)
        with pytest.raises(ValueError, match=r"a\.npz must be an \.npz file as it was written, got a damaged one"):
            read_arrays(tmp_path / "a.npz")
    with pytest.raises(FileNotFoundError):
        read_arrays(tmp_path / "b.npz")
    (tmp_path / "a.json").write_text("[" * 100_000)
    with pytest.raises(ValueError, match=r"a\.json must hold JSON as it was written, got a damaged file"):
        read_json(tmp_path / "a.json")
