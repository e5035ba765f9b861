//! The reader that stops at the limits of what is accepted.

use std::io::{BufReader, Read};

use quick_xml::reader::Reader;

use super::error::ThreeMfError;
use super::limits::{MAX_RATIO, MAX_UNPACKED, RATIO_FREE};

/// A reader that stops at the package's limits.
#[derive(Debug)]
pub struct Limited<R> {
    inner: R,
    packed: u64,
    read: u64,
    pub(super) exceeded: bool,
}

impl<R: Read> Read for Limited<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let n = self.inner.read(buffer)?;
        self.read += n as u64;
        let ratio = self.read / self.packed.max(1);
        if self.read > MAX_UNPACKED || (self.read > RATIO_FREE && ratio > MAX_RATIO) {
            self.exceeded = true;
            return Err(std::io::Error::other("more unpacked bytes than accepted"));
        }
        Ok(n)
    }
}

impl<R> Limited<R> {
    /// Nothing read yet of an entry of `packed` bytes.
    pub(super) fn new(inner: R, packed: u64) -> Self {
        Limited {
            inner,
            packed,
            read: 0,
            exceeded: false,
        }
    }

    /// The error that says so.
    pub(super) fn bomb(&self, part: &str) -> ThreeMfError {
        ThreeMfError::Bomb {
            part: part.to_owned(),
            bytes: self.read,
            packed: self.packed,
        }
    }
}

/// Why the XML of a part does not go on: a bomb, or what the XML reader says.
pub fn unread<R>(
    xml: &Reader<BufReader<Limited<R>>>,
    part: &str,
    error: &quick_xml::Error,
) -> ThreeMfError {
    let limited = xml.get_ref().get_ref();
    if limited.exceeded {
        return limited.bomb(part);
    }
    ThreeMfError::Xml {
        part: part.to_owned(),
        position: xml.error_position(),
        message: error.to_string(),
    }
}
