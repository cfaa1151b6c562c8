"""A page, its worker and its viewer, from the first request to the last."""

from app import __version__
from tests.web.conftest import Server


def test_a_page_gets_its_worker_and_status(server: Server):
    """The page's socket starts a worker, says hello and then passes on status."""
    browser = server.browser()
    page = browser.page()
    hello = page.hello
    assert hello["session"] == browser.session
    assert hello["version"] == __version__
    assert hello["control"] is True
    assert hello["view"] == f"/view/{browser.session}/"
    assert hello["methods"] == ["direct"]
    page.push(1, right=[0.5, -0.25])
    status = page.status_where(lambda s: s["input"])
    assert status["input"]["right"] == [0.5, -0.25]
    assert status["input"]["client"] == status["clients"]["control"]
    assert server.health()["sessions"] == 1
