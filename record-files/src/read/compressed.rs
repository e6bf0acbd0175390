//! The pages of a Parquet column that zstd or gzip has compressed, decoded here: for zstd the library needs one that is written in C.

use std::io::Read;
use std::sync::Arc;

use bytes::Bytes;
use parquet::basic::Compression;
use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::RowGroupMetaData;
use parquet::file::serialized_reader::SerializedPageReader;
use simulation::csv_table::text::MOST_BYTES;

/// A compression that is decoded here.
#[derive(Clone, Copy)]
pub(super) enum Codec {
    Zstd,
    Gzip,
}

impl Codec {
    /// `None` for a compression that the library decodes, or nothing does.
    pub(super) fn of(compression: Compression) -> Option<Self> {
        match compression {
            Compression::ZSTD(_) => Some(Self::Zstd),
            Compression::GZIP(_) => Some(Self::Gzip),
            _ => None,
        }
    }

    /// Adds the content of `compressed` to `plain`, at most `most` bytes of it.
    fn decode(self, compressed: &[u8], most: usize, plain: &mut Vec<u8>) -> Result<()> {
        let read = match self {
            Self::Zstd => ruzstd::decoding::StreamingDecoder::new(compressed)
                .map_err(std::io::Error::other)
                .and_then(|decoder| decoder.take(most as u64 + 1).read_to_end(plain)),
            Self::Gzip => flate2::read::MultiGzDecoder::new(compressed).take(most as u64 + 1).read_to_end(plain),
        };
        match read {
            Err(error) => Err(ParquetError::General(error.to_string())),
            Ok(count) if count > most => Err(ParquetError::General("pages that are larger than they claim".to_owned())),
            Ok(_) => Ok(()),
        }
    }
}

/// The pages of a column in a group of rows. The library reads them as if they were not compressed.
pub(super) struct Pages {
    compressed: SerializedPageReader<Bytes>,
    codec: Codec,
    /// Number of bytes that the pages still may have.
    room: usize,
}

impl Pages {
    pub(super) fn new(file: &Bytes, group: &RowGroupMetaData, index: usize, codec: Codec) -> Result<Self> {
        let column = group.column(index).clone().into_builder().set_compression(Compression::UNCOMPRESSED).build()?;
        let rows = usize::try_from(group.num_rows())?;
        let compressed = SerializedPageReader::new(Arc::new(file.clone()), &column, rows, None)?;
        Ok(Self { compressed, codec, room: MOST_BYTES })
    }

    /// The content of a page, of which the first `plain` bytes are not compressed.
    fn decoded(&mut self, page: &[u8], plain: usize) -> Result<Bytes> {
        let cut = || ParquetError::General("a page that is cut off".to_owned());
        let (plain, compressed) = page.split_at_checked(plain).ok_or_else(cut)?;
        let mut content = plain.to_vec();
        if !compressed.is_empty() {
            self.codec.decode(compressed, self.room, &mut content)?;
        }
        self.room = self.room.saturating_sub(content.len());
        Ok(content.into())
    }
}

impl PageReader for Pages {
    fn get_next_page(&mut self) -> Result<Option<Page>> {
        let Some(mut page) = self.compressed.get_next_page()? else { return Ok(None) };
        match &mut page {
            Page::DataPage { buf, .. } | Page::DictionaryPage { buf, .. } => *buf = self.decoded(buf, 0)?,
            Page::DataPageV2 { buf, def_levels_byte_len, rep_levels_byte_len, is_compressed: true, .. } => {
                *buf = self.decoded(buf, *def_levels_byte_len as usize + *rep_levels_byte_len as usize)?;
            }
            Page::DataPageV2 { .. } => (),
        }
        Ok(Some(page))
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>> {
        self.compressed.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<()> {
        self.compressed.skip_next_page()
    }

    fn at_record_boundary(&mut self) -> Result<bool> {
        self.compressed.at_record_boundary()
    }
}

impl Iterator for Pages {
    type Item = Result<Page>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}
