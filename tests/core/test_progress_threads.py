"""Progress in several threads: one that is silenced does not silence what another has to say."""

import threading

import pytest

from avlmaps.core.progress import progress, say, silence_progress


def test_a_silenced_thread_silences_itself_alone(capsys: pytest.CaptureFixture[str]) -> None:
    silenced, told = threading.Event(), threading.Event()

    def behind() -> None:
        with silence_progress():
            silenced.set()
            assert told.wait(30)
            say("from behind")
            list(progress([1], "behind"))

    thread = threading.Thread(target=behind)
    thread.start()
    assert silenced.wait(30)
    say("the address")
    told.set()
    thread.join()
    say("the end")
    assert capsys.readouterr().err == "the address\nthe end\n"


def test_silence_in_silence_ends_with_the_outer_one(capsys: pytest.CaptureFixture[str]) -> None:
    with silence_progress():
        with silence_progress(False):
            say("no")
        with silence_progress():
            say("no")
        say("no")
    say("yes")
    assert capsys.readouterr().err == "yes\n"
