"""A live run whose browser is a stand-in that keeps what it would be sent."""

import threading
from contextlib import contextmanager

from gne_mj.scenario import load_scenario
from gne_mj.viewer import Session
from gne_mj.viewer.pack import unpack

ODE = {"plant.engine": "ode", "simulation.duration": 1.0}


class Page:
    """Stands in for browsers: what they would be sent."""

    def __init__(self, session):
        self.session, self.frames, self.told, self.broadcasts = session, [], [], []
        self.welcomed = None
        server = session.server
        server.publish = self.frames.append
        server.tell = lambda message, browser=None: self.told.append(message)
        server.broadcast = self.broadcasts.append
        server.welcome = lambda browser, messages: setattr(self, "welcomed", messages)

    @property
    def last_frame(self):
        packs = [*self.frames, *self.broadcasts]
        frames = [each for each in packs if unpack(each)[0]["kind"] == "frame"]
        return max(frames, key=lambda each: (unpack(each)[0]["ended"], frames.index(each)))

    def ask(self, **message):
        self.session._receive(message, None)
        self.session._look(0.0)

    @property
    def errors(self):
        return [message["text"] for message in self.told if message["kind"] == "notice"]


@contextmanager
def watched(scenario="velocity-sync", changes=ODE, speed=None):
    session = Session(load_scenario(scenario, changes), "a title", speed=speed)
    try:
        yield session, Page(session)
    finally:
        session.server.close()


def to_the_end(session):
    """The run to its end, which is then shown, as the command does."""
    trajectory = session.run(threading.Event())
    session.show(trajectory)
    return trajectory
