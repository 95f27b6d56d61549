//! What a Parquet file says of itself and of its pages, looked at before the library reads it.
//!
//! The library passes over a list of flags flag by flag, takes none of them to be a byte, and believes the list's
//! length: a file of 22 bytes keeps it busy for half a minute. It also reads a field that it knows by its number,
//! whatever type the file gives it. So every field must be one of the format's, of its type; none of those is a list
//! of flags. Source: parquet-format 2.12, `parquet.thrift`; Thrift's compact protocol.

use std::io::{self, Read};

/// What a value is.
enum Kind {
    /// A field's own type says which of the two it is.
    Flag,
    Byte,
    Short,
    Int,
    Long,
    /// Bytes with their number before them.
    Binary,
    /// Of one kind, which takes a byte at least.
    List(&'static Kind),
    Struct(Fields),
}

use Kind::{Binary, Byte, Flag, Int, List, Long, Short, Struct};

/// Fields by number.
type Fields = &'static [(i16, Kind)];

const EMPTY: Kind = Struct(&[]);
const KEY_VALUE: Kind = Struct(&[(1, Binary), (2, Binary)]);
const UNIT_OF_TIME: Kind = Struct(&[(1, EMPTY), (2, EMPTY), (3, EMPTY)]);
const TIME: Kind = Struct(&[(1, Flag), (2, UNIT_OF_TIME)]);

const LOGICAL_TYPE: Kind = Struct(&[
    (1, EMPTY),
    (2, EMPTY),
    (3, EMPTY),
    (4, EMPTY),
    (5, Struct(&[(1, Int), (2, Int)])),
    (6, EMPTY),
    (7, TIME),
    (8, TIME),
    (10, Struct(&[(1, Byte), (2, Flag)])),
    (11, EMPTY),
    (12, EMPTY),
    (13, EMPTY),
    (14, EMPTY),
    (15, EMPTY),
]);

const SCHEMA_ELEMENT: Kind = Struct(&[
    (1, Int),
    (2, Int),
    (3, Int),
    (4, Binary),
    (5, Int),
    (6, Int),
    (7, Int),
    (8, Int),
    (9, Int),
    (10, LOGICAL_TYPE),
]);

const STATISTICS: Kind = Struct(&[
    (1, Binary),
    (2, Binary),
    (3, Long),
    (4, Long),
    (5, Binary),
    (6, Binary),
    (7, Flag),
    (8, Flag),
    (9, Long),
]);

const COLUMN_METADATA: Kind = Struct(&[
    (1, Int),
    (2, List(&Int)),
    (3, List(&Binary)),
    (4, Int),
    (5, Long),
    (6, Long),
    (7, Long),
    (8, List(&KEY_VALUE)),
    (9, Long),
    (10, Long),
    (11, Long),
    (12, STATISTICS),
    (13, List(&Struct(&[(1, Int), (2, Int), (3, Int)]))),
    (14, Long),
    (15, Int),
    (16, Struct(&[(1, Long), (2, List(&Long)), (3, List(&Long))])),
]);

const COLUMN_CHUNK: Kind = Struct(&[
    (1, Binary),
    (2, Long),
    (3, COLUMN_METADATA),
    (4, Long),
    (5, Int),
    (6, Long),
    (7, Int),
]);

const ROW_GROUP: Kind = Struct(&[
    (1, List(&COLUMN_CHUNK)),
    (2, Long),
    (3, Long),
    (4, List(&Struct(&[(1, Int), (2, Flag), (3, Flag)]))),
    (5, Long),
    (6, Long),
    (7, Short),
]);

/// `FileMetaData`, but for encryption.
const FOOTER: Fields = &[
    (1, Int),
    (2, List(&SCHEMA_ELEMENT)),
    (3, Long),
    (4, List(&ROW_GROUP)),
    (5, List(&KEY_VALUE)),
    (6, Binary),
    (7, List(&Struct(&[(1, EMPTY), (2, EMPTY)]))),
];

const PAGE_HEADER: Fields = &[
    (1, Int),
    (2, Int),
    (3, Int),
    (4, Int),
    (5, Struct(&[(1, Int), (2, Int), (3, Int), (4, Int), (5, STATISTICS)])),
    (6, EMPTY),
    (7, Struct(&[(1, Int), (2, Int), (3, Flag)])),
    (
        8,
        Struct(&[
            (1, Int),
            (2, Int),
            (3, Int),
            (4, Int),
            (5, Int),
            (6, Int),
            (7, Flag),
            (8, STATISTICS),
        ]),
    ),
];

/// Most bytes of a page's header.
const LONGEST_HEADER: u64 = 1 << 20;

/// Looks at what stands at a file's end.
///
/// Cost: its bytes once. Memory: a copy.
///
/// # Errors
/// It is cut off, or has a field that the format has not.
pub(super) fn check_footer(bytes: &[u8]) -> io::Result<()> {
    Walk::over(bytes).fields(FOOTER)
}

/// The bytes of a page's header, which a reader stands before.
///
/// # Errors
/// As [`check_footer`], and where it is longer than [`LONGEST_HEADER`].
pub(super) fn page_header(read: impl Read) -> io::Result<Vec<u8>> {
    let mut walk = Walk::over(read.take(LONGEST_HEADER));
    walk.fields(PAGE_HEADER)?;
    Ok(walk.seen)
}

/// Goes over values, and keeps their bytes.
struct Walk<R> {
    read: R,
    seen: Vec<u8>,
}

impl<R: Read> Walk<R> {
    fn over(read: R) -> Self {
        Self { read, seen: Vec::new() }
    }

    fn byte(&mut self) -> io::Result<u8> {
        let mut byte = [0];
        self.read.read_exact(&mut byte)?;
        self.seen.push(byte[0]);
        Ok(byte[0])
    }

    /// A number of seven bits a byte, the lowest first; the highest bit says that one more follows.
    fn number(&mut self) -> io::Result<u64> {
        let mut number = 0;
        for i in 0..10 {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << (7 * i);
            if byte & 0x80 == 0 {
                return Ok(number);
            }
        }
        Err(refused("a number longer than ten bytes"))
    }

    fn bytes(&mut self, count: u64) -> io::Result<()> {
        let copied = self.read.by_ref().take(count).read_to_end(&mut self.seen)?;
        if copied as u64 == count { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
    }

    /// The fields of a structure, up to its end.
    fn fields(&mut self, known: Fields) -> io::Result<()> {
        let mut last = 0;
        loop {
            let head = self.byte()?;
            let tag = head & 0x0f;
            if tag == 0 {
                return Ok(());
            }
            let field = match head >> 4 {
                0 => whole(self.number()?),
                step => i64::from(last) + i64::from(step),
            };
            let found = known.iter().find(|(number, _)| i64::from(*number) == field);
            let Some((number, kind)) = found.filter(|(_, kind)| kind.has_tag(tag)) else {
                return Err(refused(format_args!("a field {field} of type {tag}")));
            };
            last = *number;
            self.value(kind)?;
        }
    }

    fn value(&mut self, kind: &Kind) -> io::Result<()> {
        match kind {
            Flag => Ok(()),
            Byte => self.byte().map(drop),
            Short | Int | Long => self.number().map(drop),
            Binary => {
                let count = self.number()?;
                self.bytes(count)
            }
            List(kind) => {
                let head = self.byte()?;
                let count = match head >> 4 {
                    15 => self.number()?,
                    count => count.into(),
                };
                // Some writers give an empty list no type.
                if head != 0 && !kind.has_tag(head & 0x0f) {
                    return Err(refused(format_args!("a list of type {}", head & 0x0f)));
                }
                (0..count).try_for_each(|_| self.value(kind))
            }
            Struct(known) => self.fields(known),
        }
    }
}

impl Kind {
    /// Whether the protocol calls it so.
    fn has_tag(&self, tag: u8) -> bool {
        match self {
            Flag => tag == 1 || tag == 2,
            Byte => tag == 3,
            Short => tag == 4,
            Int => tag == 5,
            Long => tag == 6,
            Binary => tag == 8,
            List(_) => tag == 9,
            Struct(_) => tag == 12,
        }
    }
}

/// A number with its sign in the lowest bit.
fn whole(number: u64) -> i64 {
    (number >> 1).cast_signed() ^ -(number & 1).cast_signed()
}

fn refused(what: impl std::fmt::Display) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("{what}, which the format has not"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reason(answer: io::Result<impl Sized>) -> String {
        answer.err().expect("a refusal").to_string()
    }

    /// A list of two thousand million flags, which take no room: as a field that nobody knows, in the place of one that
    /// is known, and as elements of a known list.
    // Verifies REM-IO-006.
    #[test]
    fn lists_of_flags_are_refused() {
        let most = [0xff, 0xff, 0xff, 0xff, 0x07];
        for (head, told) in [
            (&[0x09, 0xc8, 0x01, 0xf1][..], "a field 100 of type 9"),
            (&[0x19, 0xf1], "a field 1 of type 9"),
            (&[0x29, 0xf1], "a list of type 1"),
            (&[0x2b], "a field 2 of type 11"),
            (&[0x2a, 0xf2], "a field 2 of type 10"),
        ] {
            let bytes = [head, &most, &[0]].concat();
            let told = format!("{told}, which the format has not");
            assert_eq!(reason(check_footer(&bytes)), told);
        }
        assert_eq!(
            reason(page_header(&[0x99, 0xf1][..])),
            "a field 9 of type 9, which the format has not"
        );
    }

    #[test]
    fn what_is_cut_off_is_refused() {
        for bytes in [&[][..], &[0x15], &[0x15, 0x80], &[0x68, 0x03, b'a'], &[0x59, 0xfc, 0x05]] {
            assert!(
                matches!(check_footer(bytes), Err(error) if error.kind() == io::ErrorKind::UnexpectedEof)
            );
        }
        assert!(reason(check_footer(&[0x15; 12])).contains("which the format has not"));
        assert_eq!(
            reason(check_footer(&[&[0x15][..], &[0xff; 10]].concat())),
            "a number longer than ten bytes, which the format has not"
        );
    }

    /// A header ends where it ends, whatever follows.
    #[test]
    fn the_bytes_of_a_header_are_kept() {
        let header = [0x15, 0x00, 0x15, 0x10, 0x15, 0x10, 0x2c, 0x15, 0x04, 0x00, 0x00];
        let file = [&header[..], &[0x11; 5]].concat();
        assert_eq!(page_header(&file[..]).unwrap(), header);
        // A field further back, by its whole number.
        let header = [0x25, 0x00, 0x05, 0x02, 0x00, 0x00];
        assert_eq!(page_header(&header[..]).unwrap(), header);
    }
}
