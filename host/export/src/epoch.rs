//! Begin of a plan, and times after it as text: UTC with its leap seconds, by `hifitime`'s calendar and table.
//!
//! `hifitime` turns UTC into TAI exactly. Back from TAI it changes the offset as many seconds too early as there
//! are leap seconds, and it has no second 60: that way is computed here from its table.

use hifitime::leap_seconds::{LatestLeapSeconds, LeapSecond};
use hifitime::{Epoch as Calendar, Unit};
use std::fmt;
use std::str::FromStr;
use std::time::SystemTime;

/// Microseconds of a second.
pub const MICROS: f64 = 1e6;
const SECOND: i64 = 1_000_000;

/// Seconds from 1900, where `hifitime` begins to count, to 1970.
const TO_1970: i64 = 2_208_988_800;
/// Accepted years. Before 1972 UTC had no leap seconds, and its offset from TAI was not whole seconds.
const YEARS: std::ops::RangeInclusive<i32> = 1972..=2099;
/// Seconds that TAI is ahead of UTC in 1972, and taken to be before.
const FIRST_OFFSET: i64 = 10;

/// An instant, to the microsecond.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Epoch {
    /// Since 1900 in TAI, where every second counts [µs].
    tai: i64,
}

/// A reading of UTC: its count since 1900 without leap seconds, and whether it is in a second 60, which
/// follows the one counted.
#[derive(Clone, Copy)]
struct Reading {
    micros: i64,
    is_leap: bool,
}

/// Begin of an offset [s]: in UTC without leap seconds, and the offset of TAI from then on.
fn begin_and_offset(leap: &LeapSecond) -> (i64, i64) {
    (leap.timestamp_tai_s as i64, leap.delta_at as i64)
}

/// The offsets of whole seconds, the newest first.
fn offsets() -> impl Iterator<Item = (i64, i64)> {
    let announced = LatestLeapSeconds::default().rev().filter(|leap| leap.announced_by_iers);
    announced.map(|leap| begin_and_offset(&leap))
}

impl Epoch {
    /// Now, or what `SOURCE_DATE_EPOCH` says in its place, to the second: files can be made again bit for bit.
    pub fn now() -> Self {
        let said = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|seconds| seconds.parse().ok());
        let clock = || SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let seconds: i64 = said.unwrap_or_else(|| clock().as_secs() as i64);
        // Up to the end of 2099.
        let seconds = TO_1970 + seconds.clamp(0, 4_102_444_799);
        Self::read(Reading { micros: seconds * SECOND, is_leap: false })
    }

    /// So many microseconds later.
    pub fn after(self, micros: i64) -> Self {
        Self { tai: self.tai + micros }
    }

    /// Unix time: since 1970 without leap seconds [ns]. A second 60 has that of the one after it.
    pub fn nanos(self) -> u64 {
        let Reading { micros, is_leap } = self.reading();
        let micros = micros + if is_leap { SECOND } else { 0 };
        (micros - TO_1970 * SECOND) as u64 * 1000
    }

    fn read(reading: Reading) -> Self {
        let seconds = reading.micros.div_euclid(SECOND);
        let offset = offsets().find(|(begin, _)| seconds >= *begin);
        let offset = offset.map_or(FIRST_OFFSET, |(_, offset)| offset) + i64::from(reading.is_leap);
        Self { tai: reading.micros + offset * SECOND }
    }

    fn reading(self) -> Reading {
        for (begin, offset) in offsets() {
            let begins = (begin + offset) * SECOND;
            if self.tai >= begins {
                return Reading { micros: self.tai - offset * SECOND, is_leap: false };
            }
            // TAI was already ten seconds ahead when counting began.
            if self.tai >= begins - SECOND && offset > FIRST_OFFSET {
                return Reading { micros: self.tai - offset * SECOND, is_leap: true };
            }
        }
        Reading { micros: self.tai - FIRST_OFFSET * SECOND, is_leap: false }
    }
}

/// Year, month, day, hour, minute, second, and microseconds, of exactly this form: `2026-11-23T00:00:00.5`.
fn fields(text: &str) -> Option<[u32; 7]> {
    let (date, time) = text.split_once('T')?;
    let (time, fraction) = time.split_once('.').unwrap_or((time, "0"));
    let words: Vec<&str> = date.split('-').chain(time.split(':')).collect();
    let is_number = |word: &str| !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_digit());
    let lengths = words.iter().map(|word| word.len()).eq([4, 2, 2, 2, 2, 2]);
    if !lengths || !words.iter().chain([&fraction]).all(|word| is_number(word)) {
        return None;
    }
    let micros: String = fraction.chars().chain(std::iter::repeat('0')).take(6).collect();
    let numbers: Vec<u32> =
        words.into_iter().chain([micros.as_str()]).filter_map(|word| word.parse().ok()).collect();
    numbers.try_into().ok()
}

impl FromStr for Epoch {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wanted = || {
            let years = format!("{} to {}", YEARS.start(), YEARS.end());
            format!("expected a time of UTC such as 2026-11-23T00:00:00, of the years {years}")
        };
        let bare = text.strip_suffix('Z').unwrap_or(text);
        let [year, month, day, hour, minute, second, micros] = fields(bare).ok_or_else(wanted)?;
        // All but the year are below 100.
        let [month, day, hour, minute, second] =
            [month, day, hour, minute, second].map(|number| number as u8);
        if !YEARS.contains(&(year as i32)) || hour > 23 {
            return Err(wanted());
        }
        let at = Calendar::maybe_from_gregorian_utc(
            year as i32,
            month,
            day,
            hour,
            minute,
            second,
            micros * 1000,
        );
        let counted = at.map_err(|_| wanted())?.duration.total_nanoseconds() / 1000;
        Ok(Self::read(Reading { micros: counted as i64, is_leap: second == 60 }))
    }
}

impl fmt::Display for Epoch {
    /// Writes the calendar time of CCSDS, to the microsecond.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Reading { micros, is_leap } = self.reading();
        let at = Calendar::from_utc_duration(micros * Unit::Microsecond);
        let (year, month, day, hour, minute, second, nanos) = at.to_gregorian_utc();
        let second = if is_leap { 60 } else { second };
        let micros = nanos / 1000;
        write!(f, "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{micros:06}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(text: &str, micros: i64) -> String {
        text.parse::<Epoch>().unwrap().after(micros).to_string()
    }

    #[test]
    fn times_are_counted_over_the_ends_of_days_and_years() {
        let epoch: Epoch = "2027-12-31T23:59:59.5Z".parse().unwrap();
        assert_eq!(epoch.to_string(), "2027-12-31T23:59:59.500000");
        assert_eq!(epoch.after(500_001).to_string(), "2028-01-01T00:00:00.000001");
        let bare: Epoch = "2027-12-31T23:59:59.5".parse().unwrap();
        assert_eq!(bare, epoch);
        assert_eq!("1972-01-01T00:00:01".parse::<Epoch>().unwrap().nanos(), 63_072_001_000_000_000);
    }

    /// Each second about each leap second: 58, 59, 60, then the next day's.
    #[test]
    fn a_leap_second_is_written_as_second_60() {
        for (day, next) in [
            ("1972-06-30", "1972-07-01"),
            ("1972-12-31", "1973-01-01"),
            ("1981-06-30", "1981-07-01"),
            ("1998-12-31", "1999-01-01"),
            ("2005-12-31", "2006-01-01"),
            ("2015-06-30", "2015-07-01"),
            ("2016-12-31", "2017-01-01"),
        ] {
            let begin = format!("{day}T23:59:00.25");
            for (seconds, told) in [
                (22, format!("{day}T23:59:22.250000")),
                (59, format!("{day}T23:59:59.250000")),
                (60, format!("{day}T23:59:60.250000")),
                (61, format!("{next}T00:00:00.250000")),
                (120, format!("{next}T00:00:59.250000")),
            ] {
                assert_eq!(after(&begin, seconds * SECOND), told);
                assert_eq!(told.parse::<Epoch>().unwrap().to_string(), told);
            }
            assert_eq!(
                after(&format!("{day}T23:59:60.5"), SECOND),
                format!("{next}T00:00:00.500000")
            );
        }
        // A day without one.
        assert_eq!(after("2017-12-31T23:59:00", 60 * SECOND), "2018-01-01T00:00:00.000000");
        assert_eq!(after("1972-01-01T00:00:00", 0), "1972-01-01T00:00:00.000000");
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for text in [
            "",
            "now",
            "2026-11-23",
            "2026-02-30T00:00:00",
            "2026-11-23T24:00:00",
            "2015-12-31T23:59:60",
            "2016-12-31T23:58:60",
            "2016-12-31T23:59:61",
            "1971-12-31T23:59:59",
            "1969-12-31T23:59:59",
            "2100-01-01T00:00:00",
            "2026-11-23T00:00:00+01:00",
            "2026-11-23T00:00:00.",
            "+026-11-23T00:00:00",
        ] {
            assert!(text.parse::<Epoch>().is_err(), "{text}");
        }
    }
}
