"""Tasks of a run in this process, for tests that are about something else than its workers."""

from prb3r.runs.backends.shield import shielded


class InProcess:
    """A backend that does each task at once, one after the other."""

    slots, strikes, heartbeat_s = 1, 2, 60.0

    def __init__(self, workers, function, events):
        self.function, self.events = function, events

    def __enter__(self):
        return self

    def __exit__(self, *_): ...

    def submit(self, job):
        self.events.put((job, *shielded(self.function, job.task)))

    def free(self, job, fate): ...
