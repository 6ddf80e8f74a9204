"""Shows the table of figures at the end, of what passed and what failed."""

HEAD = (
    f"{'scenario':<10}{'seed':>4}  {'renderer':<10}{'recall':>6}{'precision':>11}{'F1':>6}"
    f"{'centre':>9}{'worst size':>12}{'flies':>8}{'time':>8}"
)


def pytest_terminal_summary(terminalreporter):
    ended = [each for kind in ("passed", "failed") for each in terminalreporter.stats.get(kind, [])]
    lines = sorted(value for each in ended for key, value in each.user_properties if key == "figures")
    if lines:
        terminalreporter.section("figures: median fly and greatest errors of centre and visible size in cm, time in s")
        for line in (HEAD, *lines):
            terminalreporter.write_line(line)
