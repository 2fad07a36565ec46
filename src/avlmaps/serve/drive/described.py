"""The driving addresses as paths of an OpenAPI 3.1 document, below the path where the application is mounted."""

from typing import Any

import msgspec

from avlmaps.query.schema import ErrorAnswer
from avlmaps.serve.drive.requests import ConfirmRequest, PlanRequest

_TEMPLATE = "#/components/schemas/{name}"
_TEXT, _NUMBER, _OBJECT = {"type": "string"}, {"type": "number"}, {"type": "object"}
# An order is a command or a program, and not both.
_ONE_OF = [
    {"required": [name], "properties": {name: {"type": "string", "pattern": r"\S"}}} for name in ("words", "program")
]
_OR_NULL = {"type": ["object", "null"]}
_PLAN = {
    "order": _TEXT, "words": _TEXT, "reading": _TEXT, "program": _TEXT, "notes": {"type": "array", "items": _TEXT},
    "path": {"type": "array", "items": {"type": "array", "items": _NUMBER, "minItems": 3, "maxItems": 3}},
    "path_m": _NUMBER, "subgoals": {"type": "array", "items": _OBJECT}, "frame": _TEXT, "map": _TEXT,
    "version": _TEXT, "robot": _TEXT, "token": _TEXT, "expires_in_s": _NUMBER,
}  # fmt: skip
_STARTED = {"order": _TEXT, "state": {"const": "driving"}, "reading": _TEXT}
_STOPPED = {"stopped": {"type": "boolean"}, "note": _TEXT, "order": {"type": ["string", "null"]}}
_STATUS = {
    "state": {"enum": ["idle", "driving", "stopping", "unstopped"]}, "robot": _TEXT, "real": {"type": "boolean"},
    "pose": _OR_NULL, "frame": _TEXT, "order": _OR_NULL, "last": _OR_NULL,
    "plans_waiting": {"type": "integer", "minimum": 0}, "fault": {"type": ["string", "null"]},
}  # fmt: skip
_ERRORS = {
    "400": "The request does not fit.",
    "401": "The token of the server is missing or wrong.",
    "403": "The token names no waiting plan.",
    "409": "The robot drives already, or the plan no longer holds.",
    "413": "The body is too large.",
    "422": "The order cannot be read or planned; the sentence says why, or asks.",
    "503": "Too many orders are being read, or the robot cannot be reached.",
}


def drive_document() -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the paths below the mount, and the schemas that they refer to."""
    types = [PlanRequest, ConfirmRequest, ErrorAnswer]
    (plan, confirm, error), schemas = msgspec.json.schema_components(types, ref_template=_TEMPLATE)

    order = {"allOf": [plan], "oneOf": _ONE_OF}

    def answers(status: str, about: str, fields: dict[str, Any]) -> dict[str, Any]:
        schema = {"type": "object", "properties": fields, "required": list(fields)}
        found = {code: _json(text, error) for code, text in _ERRORS.items()}
        return {status: _json(about, schema)} | found

    stopped = {"type": "object", "properties": _STOPPED, "required": list(_STOPPED)}
    stop = answers("200", "The robot stands.", _STOPPED)
    stop["503"] = _json("The robot did not confirm that it stands.", stopped)
    status = answers("200", "What the robot does.", _STATUS)
    status["200"]["content"]["text/event-stream"] = {"schema": _TEXT}
    return {
        "/plan": {"post": {
            "operationId": "planDrive",
            "summary": "Plan a command or a program. Nothing moves.",
            "requestBody": {"required": True, "content": {"application/json": {"schema": order}}},
            "responses": answers("200", "The plan and its token.", _PLAN),
        }},
        "/confirm": {"post": {
            "operationId": "confirmDrive",
            "summary": "Start the plan of a token. The robot moves.",
            "requestBody": {"required": True, "content": {"application/json": {"schema": confirm}}},
            "responses": answers("202", "The robot drives.", _STARTED),
        }},
        "/stop": {"post": {
            "operationId": "stopDrive",
            "summary": "Stop the robot and forget every plan. A body is not read.",
            "responses": stop,
        }},
        "/status": {"get": {
            "operationId": "driveStatus",
            "summary": "Return what the robot does, once or as events after each change.",
            "responses": status,
        }},
    }, schemas  # fmt: skip


def _json(about: str, schema: Any) -> dict[str, Any]:
    return {"description": about, "content": {"application/json": {"schema": schema}}}
