"""The review's data: the list with what is wrong, curves, notes, and no way out of the folder."""

import json
import shutil
import time
from pathlib import Path

import httpx
import msgspec
import numpy as np
import pytest

from app.recording.cache import cache_path
from app.recording.container import TrialEncoder
from app.recording.entry import index_of
from app.recording.log_file import iter_steps
from app.recording.reader import read_trial
from app.recording.store import entry_of
from app.review.notes import notes_path
from app.review.packing import MAX_POINTS, unpack
from app.review.secret import Password, write_password
from tests.review.conftest import Logs, Review, StartReview, write_broken

OUTSIDE = (
    "../secret.mcap",
    "..%2F..%2Fsecret.mcap",
    "%2Fetc%2Fpasswd",
    "link.mcap",
    "linked/secret.mcap",
    "pilot/private/secret.mcap",
    "pilot%5C..%5Csecret.mcap",
    "a%00b.mcap",
    "trial-001.parquet",
)


def test_the_list_says_what_is_wrong_and_leaves_the_rest(copied: Logs, review_of: StartReview):
    """Torn, empty, foreign and newer logs are listed with their problem; good ones still open."""
    broken = write_broken(copied)
    review = review_of(copied.root)
    review.open_page()
    rows = review.trials()
    for trial_id, problem in broken.items():
        assert problem in rows[trial_id]["problem"], rows[trial_id]
        answer = review.done(review.http.get(f"/api/review/trial/{trial_id}/signals"))
        assert answer.status_code == 422 and problem in answer.json()["error"]
        assert str(copied.root) not in answer.text
    for trial_id in (copied.glass, copied.block, copied.canteen):
        assert rows[trial_id]["problem"] == "" and rows[trial_id]["outcome"] == "grasped"
        answer = review.done(review.http.get(f"/api/review/trial/{trial_id}/signals"))
        assert answer.status_code == 200


def test_a_new_trial_appears_and_its_picture_follows(copied: Logs, review_of: StartReview):
    """The next look at the list has it; the hand's path and the opposition come a little later."""
    review = review_of(copied.root)
    before = review.trials()
    path = copied.path(copied.glass)
    shutil.copy(path, path.with_name("trial-021.mcap"))
    shutil.copy(cache_path(path), path.with_name("trial-021.parquet"))
    fresh = review.trials().keys() - before.keys()
    assert [Path(name).name for name in fresh] == ["trial-021.mcap"]
    while (row := review.trials()[copied.glass])["path"] is None:
        pass
    hand = read_trial(path).steps["hand_position_m"]
    assert row["path"][:2] == pytest.approx(hand[0, :2], abs=1e-3)
    assert row["path"][-2:] == pytest.approx(hand[-1, :2], abs=1e-3)
    assert 0.0 <= row["opposed"] <= 1.0


def test_pictures_do_not_need_a_cache(copied: Logs, review_of: StartReview, monkeypatch):
    """Where it is missing it is made in passing, but for a log that takes long to read."""
    steps = {name: entry_of(copied.path(name)).steps for name in (copied.glass, copied.block)}
    assert steps[copied.block] < steps[copied.glass]
    monkeypatch.setattr("app.review.glance.MAX_STEPS", steps[copied.block])
    caches = {name: cache_path(copied.path(name)) for name in steps}
    for cache in caches.values():
        cache.unlink()
    review = review_of(copied.root)
    while review.trials()[copied.block]["path"] is None:
        time.sleep(0.05)
    assert review.trials()[copied.glass]["path"] is None
    assert {name: cache.is_file() for name, cache in caches.items()} == {
        copied.glass: False,
        copied.block: True,
    }


def test_an_unfinished_log_is_listed_and_cannot_be_opened(copied: Logs, review_of: StartReview):
    """Nobody writes it any more: interrupted, and the refusal says so."""
    path = copied.path(copied.glass)
    part = path.with_name("trial-031.mcap.part")
    part.write_bytes(path.read_bytes()[:-5000])
    review = review_of(copied.root)
    trial_id = copied.glass.replace("trial-001.mcap", "trial-031.mcap.part")
    assert review.trials()[trial_id]["outcome"] == "interrupted"
    answer = review.http.get(f"/api/review/trial/{trial_id}/signals")
    assert answer.status_code == 422 and "interrupted" in answer.json()["error"]


def test_paths_outside_the_folder_are_refused(copied: Logs, review_of: StartReview):
    """Dots, slashes, links, the private folder: refused in words, and nothing of them is served."""
    outside = copied.root.parent / "elsewhere"
    outside.mkdir()
    content = copied.path(copied.glass).read_bytes()
    for path in (copied.root.parent / "secret.mcap", outside / "secret.mcap"):
        path.write_bytes(content)
    (copied.root / "link.mcap").symlink_to(outside / "secret.mcap")
    (copied.root / "linked").symlink_to(outside)
    (copied.root / "pilot" / "private").mkdir()
    (copied.root / "pilot" / "private" / "secret.mcap").write_bytes(content)
    review = review_of(copied.root)
    review.open_page()
    for trial_id in OUTSIDE:
        for ending in ("signals", "notes"):
            answer = review.http.get(f"/api/review/trial/{trial_id}/{ending}")
            assert answer.status_code in (403, 404) and answer.json()["error"]
        answer = review.act("POST", f"/api/review/trial/{trial_id}/what-if", {"loop": "open"})
        assert answer.status_code in (403, 404)
    assert not any("secret" in name or "link" in name for name in review.trials())


def test_curves_are_the_log(review: Review, logs: Logs):
    """Every curve that is recorded as such comes as it was, in single precision."""
    answer = review.http.get(f"/api/review/trial/{logs.glass}/signals")
    meta, arrays = unpack(answer.content)
    log = read_trial(logs.path(logs.glass))
    assert meta["n"] == meta["n_steps"] == log.n_steps and meta["stride"] == 1
    assert meta["instructed_goal"] == "glass" and meta["participant"] == "p01"
    for index in range(6):
        for name, field in (
            ("input", "direct_twist"),
            ("assistance", "assistance_twist"),
            ("known", "known_goal_assistance_twist"),
        ):
            logged = log.steps[field][:, index].astype(np.float32)
            assert np.array_equal(arrays[f"{name}.{index}"], logged), (name, index)
    for goal, name in enumerate(log.header.goal_names):
        for key, field in (("belief", "belief"), ("values", "values"), ("q-values", "q_values")):
            logged = log.steps[field][:, goal].astype(np.float32)
            assert np.array_equal(arrays[f"{key}.{name}"], logged)
    dot = (log.steps["direct_twist"][:, :3] * log.steps["assistance_twist"][:, :3]).sum(axis=1)
    assert np.allclose(arrays["dot"], dot, atol=1e-7)
    assert np.allclose(arrays["seconds"], log.steps["time_s"], atol=1e-5)
    curves = [curve["array"] for panel in meta["panels"] for curve in panel["curves"]]
    assert set(curves) <= arrays.keys() and len(curves) == len(set(curves))


def test_the_hand_ends_at_the_grasp(review: Review, logs: Logs):
    """The distance to the instructed goal falls to a few millimetres where the hand closes."""
    meta, arrays = unpack(review.http.get(f"/api/review/trial/{logs.glass}/signals").content)
    closes = next(m["step"] for m in meta["marks"] if m["label"] == "hand closes")
    distance = arrays["distance.glass"]
    assert distance[closes] < 0.03 < 0.1 < distance[0]


def test_marks_tell_the_story(review: Review, logs: Logs):
    """First input, lead, method, settings, hold, hand and outcome, in the order they happened."""
    meta, _ = unpack(review.http.get(f"/api/review/trial/{logs.glass}/signals").content)
    labels = [mark["label"] for mark in meta["marks"]]
    wanted = ["first input", "leads: glass", "method: blend", "settings change", "assistance off"]
    wanted += ["assistance on", "arm held", "hand closes", "hand lifts", "grasped"]
    assert [label for label in labels if label in wanted] == wanted
    steps = [mark["step"] for mark in meta["marks"]]
    assert steps == sorted(steps)


def test_a_range_is_finer_than_the_whole(review: Review, logs: Logs, monkeypatch):
    """Long trials come thinned, with their last step; a part of them comes in full."""
    monkeypatch.setattr("app.review.packing.MAX_POINTS", 100)
    url = f"/api/review/trial/{logs.glass}/signals"
    meta, arrays = unpack(review.http.get(url).content)
    assert meta["stride"] > 1 and meta["n"] <= 102
    assert arrays["step"][-1] == meta["n_steps"] - 1
    part, detail = unpack(review.http.get(url + "?first=50&last=99").content)
    assert part["stride"] == 1 and detail["step"].tolist() == list(range(50, 100))


def test_a_missing_cache_is_made(copied: Logs, review_of: StartReview):
    """The first look waits for it and tells how far it is; it lies beside the log then."""
    cache = cache_path(copied.path(copied.block))
    cache.unlink()
    review = review_of(copied.root)
    url = f"/api/review/trial/{copied.block}/signals"
    first = review.http.get(url)
    assert first.status_code == 202 and 0.0 <= first.json()["progress"] <= 1.0
    made = review.done(first)
    assert made.status_code == 200 and cache.is_file()
    assert review.http.get(url).content == made.content


@pytest.mark.slow
@pytest.mark.timeout(1500)
def test_a_two_hour_log_opens_thinned_and_leaves_the_rest(copied: Logs, review_of: StartReview):
    """720 000 steps: listed like any other, opened with its cache made, its end in sight."""
    source = copied.path(copied.block)
    log, steps = read_trial(source), list(iter_steps(source))
    assert log.summary is not None
    running = [step for step in steps if step.phase == "running"][40]
    tail = msgspec.json.encode(running).split(b",", 1)[1]
    n_steps = 720_000
    long = source.with_name("trial-041.mcap")
    encoder = TrialEncoder()
    encoder.add("trial", log.header, 0, 0)
    with long.open("wb") as file:
        for number in range(n_steps):
            encoder.add("step", b'{"step":%d,' % number + tail, number, number)
            if number % 20_000 == 0:
                file.write(encoder.buffer.waiting)
                encoder.buffer.drop(len(encoder.buffer.waiting))
        summary = msgspec.structs.replace(log.summary, steps=n_steps, duration_s=7200.0)
        encoder.add("summary", summary, n_steps, 0)
        encoder.finish(index_of(log.header, summary))
        file.write(encoder.buffer.waiting)
    review = review_of(copied.root)
    trial_id = copied.block.replace("trial-002", "trial-041")
    rows = review.trials()
    assert rows[trial_id]["problem"] == "" and rows[trial_id]["steps"] == n_steps
    assert rows[copied.glass]["problem"] == ""
    first = review.http.get(f"/api/review/trial/{trial_id}/signals")
    opened = review.done(first, patience_s=1200.0)
    meta, arrays = unpack(opened.content)
    assert meta["n_steps"] == n_steps and meta["n"] <= MAX_POINTS + 1
    assert arrays["seconds"][-1] == pytest.approx(7200.0, abs=0.1)
    assert review.http.get(f"/api/review/trial/{copied.glass}/signals").status_code == 200


def test_notes_live_beside_the_log(copied: Logs, review_of: StartReview):
    """A flag and a note are kept in a file of their own; the log does not change by a byte."""
    review = review_of(copied.root)
    review.open_page()
    log = copied.path(copied.glass)
    before = log.read_bytes()
    url = f"/api/review/trial/{copied.glass}/notes"
    empty = review.http.get(url).json()
    assert (empty["flag"], empty["text"], empty["revision"]) == (False, "", 0)
    moments = [{"step": 40, "text": "hesitates"}]
    body = {"flag": True, "text": "looks away", "moments": moments, "revision": 0}
    assert review.act("PUT", url, body).json()["revision"] == 1
    assert json.loads(notes_path(log).read_text())["text"] == "looks away"
    assert notes_path(log).name == "trial-001.notes.json" and log.read_bytes() == before
    row = review.trials()[copied.glass]
    assert row["flag"] is True and row["note"] == "looks away"
    stale = review.act("PUT", url, {**body, "text": "overwrites"})
    assert stale.status_code == 409
    assert review.http.get(url).json()["text"] == "looks away"
    wrong = review.act("PUT", url, {"flag": "yes", "revision": 1})
    assert wrong.status_code == 422 and "flag" in wrong.json()["error"]


def test_damaged_notes_are_told_and_spare_the_list(copied: Logs, review_of: StartReview):
    """The row says that its notes are damaged; they are not overwritten by an empty note."""
    notes_path(copied.path(copied.glass)).write_text("{torn")
    review = review_of(copied.root)
    review.open_page()
    assert "damaged" in review.trials()[copied.glass]["note_problem"]
    url = f"/api/review/trial/{copied.glass}/notes"
    assert review.act("PUT", url, {"flag": True, "revision": 0}).status_code == 422
    assert notes_path(copied.path(copied.glass)).read_text() == "{torn"


def test_only_our_own_page_acts(review: Review, logs: Logs):
    """Another origin, or no cookie, changes nothing and opens no socket."""
    url = f"/api/review/trial/{logs.glass}/notes"
    other = review.http.put(url, json={"revision": 0}, headers={"origin": "http://evil.example"})
    assert other.status_code == 403
    bare = httpx.put(review.url + url, json={}, headers={"origin": review.url}, trust_env=False)
    assert bare.status_code == 403
    renamed = httpx.get(review.url + "/review", headers={"host": "evil.example"}, trust_env=False)
    assert renamed.status_code == 421
    assert not notes_path(logs.path(logs.glass)).exists()


def test_behind_a_password_nothing_is_read_without_it(
    logs: Logs, review_of: StartReview, tmp_path: Path
):
    """Page and data ask for the login; the right password opens both."""
    secret = tmp_path / "password"
    write_password(secret, "correct horse battery")
    assert secret.stat().st_mode & 0o777 == 0o600
    assert "correct horse" not in secret.read_text()
    review = review_of(logs.root, Password(secret))
    sent_away = review.http.get("/review")
    assert sent_away.status_code == 303 and sent_away.headers["location"] == "/review/login"
    for path in ("/api/review/trials", f"/api/review/trial/{logs.glass}/signals"):
        assert review.http.get(path).status_code == 403
    headers = {"origin": review.url}
    wrong = review.http.post("/review/login", data={"password": "no"}, headers=headers)
    assert wrong.status_code == 403 and "not the password" in wrong.text
    data = {"password": "correct horse battery"}
    assert review.http.post("/review/login", data=data, headers=headers).status_code == 303
    review.open_page()
    assert len(review.trials()) == 3


def test_unknown_addresses_and_computations_are_said_in_words(review: Review, logs: Logs):
    """A 404 with a sentence; a wish that makes no sense is refused before anything starts."""
    for path in ("/api/review/nothing", "/api/review/jobs/0123"):
        answer = review.http.get(path)
        assert answer.status_code == 404 and answer.json()["error"]
    url = f"/api/review/trial/{logs.glass}/what-if"
    for body, word in (
        ({"loop": "open", "changes": {"gain": 7}}, "gain"),
        ({"loop": "open", "changes": {"method": "magic"}}, "method"),
        ({"loop": "round"}, "round"),
        ({"changes": {"speed": 1}}, "speed"),
        ({"step": -4}, "step"),
    ):
        answer = review.act("POST", url, body)
        assert answer.status_code == 422 and word in answer.json()["error"], answer.text
