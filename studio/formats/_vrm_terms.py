"""What an avatar's file says about who made it and what one may do with it."""

from __future__ import annotations

from typing import Any

from studio.motion.avatar import Licence

_LONGEST = 120
_WHO_OLD = {
    "OnlyAuthor": "Only its author may use it.",
    "ExplicitlyLicensedPerson": "Only people its author names may use it.",
    "Everyone": "Everyone may use it.",
}
_WHO = {
    "onlyAuthor": _WHO_OLD["OnlyAuthor"],
    "onlySeparatelyLicensedPerson": _WHO_OLD["ExplicitlyLicensedPerson"],
    "everyone": _WHO_OLD["Everyone"],
}
_BUSINESS_OLD = {"Allow": "Commercial use is allowed.", "Disallow": "No commercial use."}
_BUSINESS = {
    "personalNonProfit": "No commercial use.",
    "personalProfit": "Commercial use by persons is allowed.",
    "corporation": "Commercial use is allowed.",
}


def read(meta: Any, old: bool) -> Licence:
    """Title, authors and terms; what the file leaves open is left out."""
    if not isinstance(meta, dict):
        return Licence()
    if old:
        authors = [_text(meta.get("author"))]
        who, business = _WHO_OLD.get(str(meta.get("allowedUserName"))), _BUSINESS_OLD.get(
            str(meta.get("commercialUssageName"))
        )  # fmt: skip
        licence = _text(meta.get("licenseName")).replace("_", " ")
        title = _text(meta.get("title"))
    else:
        listed = meta.get("authors")
        authors = [_text(author) for author in listed[:5]] if isinstance(listed, list) else []
        # What a VRM 1 leaves out is the strictest choice. Source: VRMC_vrm 1.0, meta.
        who = _WHO.get(str(meta.get("avatarPermission", "onlyAuthor")))
        business = _BUSINESS.get(str(meta.get("commercialUsage", "personalNonProfit")))
        licence, title = _text(meta.get("licenseUrl")), _text(meta.get("name"))
    terms = [sentence for sentence in (who, business) if sentence]
    terms += [f"Licence: {licence}"] if licence and licence != "Other" else []
    return Licence(title, tuple(author for author in authors if author), tuple(terms))


def _text(value: Any) -> str:
    """One short line of a file's text."""
    line = " ".join(str(value).split()) if isinstance(value, str) else ""
    line = "".join(character for character in line if character.isprintable())
    return line if len(line) <= _LONGEST else line[: _LONGEST - 1] + "…"
