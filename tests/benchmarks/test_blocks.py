"""Blocks of the READMEs: what stands between their markers is replaced, and nothing else."""

import pytest

from benchmarks.blocks import BLOCKS, ROOT, block, markers, publish_blocks, replace_block

TEXT = "# Title\n\n<!-- energy:begin -->\nold\n<!-- energy:end -->\n\nafter `<!-- other:begin -->`\n"


def test_the_body_is_replaced_and_the_rest_stays():
    text = replace_block(TEXT, "energy", "| a |\n| b |\n")
    assert text == TEXT.replace("old\n", "| a |\n| b |\n")
    assert block(text, "energy") == "| a |\n| b |\n"
    assert replace_block(text, "energy", "old\n") == TEXT


def test_a_body_that_holds_backslashes_and_the_old_body_elsewhere_are_taken_literally():
    twice = TEXT + "old\n"
    assert replace_block(twice, "energy", "\\1\n") == TEXT.replace("old\n", "\\1\n") + "old\n"


@pytest.mark.parametrize(
    "text",
    [
        "no markers\n",
        TEXT + TEXT,
        "<!-- energy:end -->\n<!-- energy:begin -->\n",
        "<!-- energy:begin -->\n",
        "<!-- energy:begin --> <!-- energy:end -->\n",
    ],
)
def test_markers_that_are_not_there_once_in_their_order_are_refused(text):
    with pytest.raises(ValueError, match=r"^text must have <!-- energy:begin --> and then <!-- energy:end --> once"):
        replace_block(text, "energy", "new\n")


@pytest.fixture
def copies(tmp_path):
    """A project of READMEs with empty blocks, and results whose files hold their own names."""
    results = tmp_path / "results"
    results.mkdir()
    for readme, blocks in BLOCKS.items():
        path = tmp_path / readme
        path.parent.mkdir(exist_ok=True)
        path.write_text("text\n" + "".join("".join(markers(name)) for name in blocks))
        for file in blocks.values():
            (results / file).write_text(f"{file}\n")
    return tmp_path, results


def test_publishing_fills_every_block_and_says_which_files_changed(copies):
    root, results = copies
    assert publish_blocks(results, root) == [root / readme for readme in BLOCKS]
    for readme, blocks in BLOCKS.items():
        text = (root / readme).read_text()
        assert {name: block(text, name) for name in blocks} == {name: f"{file}\n" for name, file in blocks.items()}
    assert publish_blocks(results, root) == []


def test_nothing_is_written_when_one_readme_has_no_markers(copies):
    root, results = copies
    *others, last = BLOCKS
    (root / last).write_text("no markers\n")
    before = {readme: (root / readme).read_text() for readme in others}
    with pytest.raises(ValueError, match="text must have"):
        publish_blocks(results, root)
    assert {readme: (root / readme).read_text() for readme in others} == before


def test_the_readmes_of_the_project_have_their_markers():
    for readme, blocks in BLOCKS.items():
        text = (ROOT / readme).read_text(encoding="utf-8")
        for name in blocks:
            assert block(text, name).startswith("| ")
