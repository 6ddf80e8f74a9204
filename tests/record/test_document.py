from flysim.record.document import report_markdown

EVIL = "a [b](http://x) <img src=y> ![c](z) | `d` *e*\n# f\x1b"


def test_names_on_the_page_are_words_and_nothing_else():
    page = report_markdown(
        {"scenario": EVIL, "seed": 0, "obstacles": [{"name": EVIL, "detected": False}], "surface": {}, "stops": []}
    )
    shown = r"a \[b\](http://x) \<img src=y\> \!\[c\](z) \| \`d\` \*e\*?# f?"
    assert f"# {shown}, seed 0\n" in page
    assert f"| {shown} | no |" in page


def test_an_ordinary_name_is_shown_as_it_is():
    assert "# paper_a-2, seed 3" in report_markdown({"scenario": "paper_a-2", "seed": 3})
