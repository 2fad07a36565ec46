"""Errors as HTTP responses, the same for the API and for agents."""

import logging

from starlette.responses import Response

from avlmaps.serve.errors import RequestError
from avlmaps.serve.service import Service
from avlmaps.serve.work import encoded

JSON_TYPE = "application/json"
log = logging.getLogger("avlmaps.serve")


def error_response(service: Service, error: BaseException) -> Response:
    """Return an error as the JSON that the command line prints; what is a fault of ours goes to the log."""
    status, answer = service.privacy.described(error)
    if status >= 500 and not isinstance(error, RequestError):
        log.error("%s", error, exc_info=error if status == 500 else None)
    headers = error.headers if isinstance(error, RequestError) else {}
    return Response(encoded(answer), status, headers, JSON_TYPE)
