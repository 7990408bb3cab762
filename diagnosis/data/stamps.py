"""Times as clocks and stopwatches write them, of a column of a pandas table."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd


def stamps_of(values: pd.Series) -> np.ndarray | None:
    """Seconds since the first, of a clock, of a stopwatch, or of such written as texts; None where it is none of these."""
    if values.dtype.kind != "m":
        dates = dates_of(values)
        if dates is None:
            return _times_of_day(values)
        values = dates
    return (values - values.iloc[0]).dt.total_seconds().to_numpy(float)


def dates_of(values: pd.Series) -> pd.Series | None:
    """Time stamps with a date, of a clock or written as texts; None where there is none."""
    if values.dtype.kind == "M":
        return values
    texts = _clocks(values)
    if texts is None or _without_date(texts):
        return None
    dotted = bool(re.match(r"\d{1,2}\.\d{1,2}\.\d", texts.iloc[0]))
    return pd.to_datetime(texts, format="mixed", dayfirst=dotted, errors="coerce", utc=True)


def _times_of_day(values: pd.Series) -> np.ndarray | None:
    texts = _clocks(values)
    if texts is None:
        return None
    found = pd.to_timedelta(texts.where(texts.str.count(":") > 1, "00:" + texts), errors="coerce")
    past = found.dt.total_seconds().to_numpy(float)
    return past - past[0] + 86400.0 * np.cumsum(np.append(0.0, np.diff(past) < -43200.0))  # past midnight


def _clocks(values: pd.Series) -> pd.Series | None:
    """Texts of which most are times with hours or minutes, with a decimal point."""
    if values.dtype.kind in "fiubmM" or not len(values):
        return None
    texts = values.astype(str).str.strip().str.replace(r"(?<=:\d\d),", ".", regex=True)
    return texts if texts.iloc[:1000].str.contains(r"\d:\d\d", regex=True).mean() > 0.5 else None


def _without_date(texts: pd.Series) -> bool:
    hours = texts.iloc[0].split(":")[0]
    return not hours.strip().rpartition(" ")[0] and not re.search(r"[-./T]", hours)


def began(values: pd.Series) -> str:
    """When the first row was recorded, ISO 8601, where the column of time tells a date; "" where not."""
    dates = dates_of(values)
    if dates is None or pd.isna(dates.iloc[0]):
        return ""
    return dates.iloc[0].tz_localize(None).isoformat(timespec="seconds")
