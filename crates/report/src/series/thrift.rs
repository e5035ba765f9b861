//! The part of the Thrift compact protocol that Parquet's metadata needs.
//!
//! Source: Apache Thrift, "Thrift Compact protocol encoding", doc/specs/thrift-compact-protocol.md.

/// Wire types of fields and list elements.
const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;

/// A structure being written; fields come in ascending order.
pub(super) struct Struct<'b> {
    bytes: &'b mut Vec<u8>,
    last: u8,
}

/// Writes a structure: `fields` writes its fields, then it is closed.
pub(super) fn structure(bytes: &mut Vec<u8>, fields: impl FnOnce(&mut Struct<'_>)) {
    let mut s = Struct { bytes, last: 0 };
    fields(&mut s);
    s.bytes.push(0);
}

impl Struct<'_> {
    fn field(&mut self, id: u8, wire: u8) {
        // ids of Parquet rise by less than 16, so the short form always serves
        self.bytes.push((id - self.last) << 4 | wire);
        self.last = id;
    }

    /// A 32-bit integer or enumeration.
    pub(super) fn i32(&mut self, id: u8, value: i32) {
        self.field(id, I32);
        zigzag(self.bytes, i64::from(value));
    }

    /// A 64-bit integer.
    pub(super) fn i64(&mut self, id: u8, value: i64) {
        self.field(id, I64);
        zigzag(self.bytes, value);
    }

    /// A string.
    pub(super) fn string(&mut self, id: u8, value: &str) {
        self.field(id, BINARY);
        string(self.bytes, value);
    }

    /// A structure.
    pub(super) fn structure(&mut self, id: u8, fields: impl FnOnce(&mut Struct<'_>)) {
        self.field(id, STRUCT);
        structure(self.bytes, fields);
    }

    /// A list of structures.
    pub(super) fn structures<T>(
        &mut self,
        id: u8,
        items: &[T],
        mut fields: impl FnMut(&mut Struct<'_>, &T),
    ) {
        self.list(id, STRUCT, items.len());
        for item in items {
            structure(self.bytes, |s| fields(s, item));
        }
    }

    /// A list of enumerations.
    pub(super) fn enums(&mut self, id: u8, values: &[i32]) {
        self.list(id, I32, values.len());
        for &value in values {
            zigzag(self.bytes, i64::from(value));
        }
    }

    /// A list of strings.
    pub(super) fn strings(&mut self, id: u8, values: &[&str]) {
        self.list(id, BINARY, values.len());
        for value in values {
            string(self.bytes, value);
        }
    }

    fn list(&mut self, id: u8, wire: u8, len: usize) {
        self.field(id, LIST);
        if len < 15 {
            self.bytes.push((len as u8) << 4 | wire);
        } else {
            self.bytes.push(0xf0 | wire);
            varint(self.bytes, len as u64);
        }
    }
}

fn string(bytes: &mut Vec<u8>, value: &str) {
    varint(bytes, value.len() as u64);
    bytes.extend_from_slice(value.as_bytes());
}

fn zigzag(bytes: &mut Vec<u8>, value: i64) {
    varint(
        bytes,
        (value.wrapping_shl(1) ^ (value >> 63)).cast_unsigned(),
    );
}

fn varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push((value & 0x7f) as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_examples() {
        let mut bytes = Vec::new();
        varint(&mut bytes, 50399);
        assert_eq!(bytes, [0xdf, 0x89, 0x03]);
        let mut bytes = Vec::new();
        for value in [0, -1, 1, -2, 2] {
            zigzag(&mut bytes, value);
        }
        assert_eq!(bytes, [0, 1, 2, 3, 4]);
    }

    #[test]
    fn fields_lists_and_structures_nest() {
        let mut bytes = Vec::new();
        structure(&mut bytes, |s| {
            s.i32(1, 1);
            s.structure(3, |inner| inner.string(1, "ab"));
            s.enums(4, &[0; 20]);
        });
        let mut expected = vec![0x15, 2, 0x2c, 0x18, 2, b'a', b'b', 0, 0x19, 0xf5, 20];
        expected.extend([0; 20]);
        expected.push(0);
        assert_eq!(bytes, expected);
    }
}
