"""Tasks: size adapted to the duration of the cases, lost tasks repeated."""

import json

import pytest

from refusals import refused
from rotorsim.campaign import scheduler as pumping
from rotorsim.campaign.scheduler import LARGEST, TASK, ClusterError, ClusterWorkers, Pump


class KilledWorker(Exception):  # noqa: N818 - the name that Dask gives it
    pass


class Future:
    """A task that is over at once: done, lost with its worker, or cancelled."""

    def __init__(self, key, orders, seconds):
        self.key, self.rows = key, [{"number": order["number"], "duration": seconds} for order in json.loads(orders)]
        lost = any(row["number"] < 0 for row in self.rows)
        self.status = "error" if lost else "finished"

    def add_done_callback(self, call):
        call(self)

    def exception(self):
        return KilledWorker("a worker")


class Client:
    status, workers, seconds = "running", 2, 0.0

    def scheduler_info(self, n_workers):
        return {"workers": {number: {"nthreads": 1} for number in range(self.workers)}}

    def submit(self, function, orders, key, pure):
        return Future(key, orders, self.seconds)

    def gather(self, futures):
        return [json.dumps(future.rows) for future in futures]


@pytest.fixture
def client(monkeypatch):
    monkeypatch.setattr(pumping, "TICK", 0.01)
    return Client()


def all_rows(pump):
    rows = []
    while len(pump):
        rows += pump.rows()
    return rows


@pytest.mark.parametrize(("seconds", "size"), [(0.0, LARGEST), (0.1, 3), (TASK, 1), (60.0, 1)])
def test_short_cases_share_a_task(client, seconds, size):
    client.seconds = seconds
    pump = Pump(ClusterWorkers(client), "run")
    assert pump.room > 0 and pump.size(10**6) == 1, "nothing is known of the first"
    for number in range(300):
        pump.give([{"number": number}])
        all_rows(pump)
    assert pump.size(10**6) == size
    assert pump.size(5) == 1, "the last cases are spread over the workers"


def test_of_a_task_that_is_lost_each_case_is_given_again_alone(client):
    pump = Pump(ClusterWorkers(client), "run")
    pump.give([{"number": number} for number in (1, -2, 3)])
    rows = {row["number"]: row for row in all_rows(pump)}
    assert sorted(rows) == [-2, 1, 3] and "error" not in rows[1] and "error" not in rows[3]
    assert rows[-2]["status"] == "failed" and "the worker died several times" in rows[-2]["error"]


def test_without_workers_for_long_a_campaign_gives_up(client, monkeypatch):
    monkeypatch.setattr(pumping, "ALONE", -1.0)
    pump, client.workers = Pump(ClusterWorkers(client), "run"), 0
    with refused(ClusterError, "workers", -1.0):
        list(pump.rows())
    client.status = "closed"
    with pytest.raises(ClusterError, match="the connection is lost"):
        list(pump.rows())
