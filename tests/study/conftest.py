"""One running study for the tests that talk to it."""

from collections.abc import Iterator

import pytest

from app.study.server.password import ENVIRONMENT, set_password
from tests.study.server import StudyServer

PASSWORD = "correct horse battery"


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[StudyServer]:
    """A test run of the paper's study, with a desk."""
    running = StudyServer(tmp_path_factory.mktemp("study"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(ENVIRONMENT, PASSWORD)
        set_password(running.sessions)
    try:
        yield running.start()
    finally:
        running.stop()
