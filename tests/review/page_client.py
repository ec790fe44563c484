"""A browser's part in tests, in process: keeps the cookie, sends the CSRF header back."""

import warnings

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # Starlette recommends another HTTP library for its client
    from starlette.testclient import TestClient

HOST = "http://127.0.0.1:8000"


class PageClient(TestClient):
    """Logged in as the owner where there is one, else by ``login``; failures of routes are answers, as in a browser."""

    def __init__(self, app, login=None):
        super().__init__(app, base_url=HOST, raise_server_exceptions=False)
        self.csrf = None
        people = app.state.review.people
        if login is None and people.owner is not None:
            login = {"token": people.token}
        if login:
            answer = self.post("/api/session", json=login)
            assert answer.status_code == 200, answer.text
            self.csrf = answer.json()["csrf"]
            self.headers["X-Mimique-CSRF"] = self.csrf


def stranger(app):
    """Return a client without a session."""
    return PageClient(app, login={})
