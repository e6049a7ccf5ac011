"""The progress bar: for a terminal only, from any thread."""

from threading import Thread

from impasto.progress import progress


def test_nothing_is_shown_where_nobody_looks(capfd):
    with progress("Stacking", 10) as advance:
        advance(10)
    assert capfd.readouterr() == ("", "")


def test_work_is_counted_from_any_thread(capfd, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    with progress("Stacking", 8, done=4, show=True) as advance:
        workers = [Thread(target=advance, args=(1,)) for _ in range(4)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
    out, err = capfd.readouterr()
    assert out == ""
    assert "Stacking" in err
    assert "100%" in err
