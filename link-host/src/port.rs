//! A port to the MCU: a serial device or pseudo-terminal by its path, or `unix:PATH` and `tcp:HOST:PORT` for the
//! emulator.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::sync::mpsc::channel;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Result;

use simulation::bad_input;

/// Longest wait for received bytes.
const POLL: Duration = Duration::from_millis(5);
/// Longest wait for bytes to be taken by the device or socket.
const WRITE: Duration = Duration::from_secs(1);

/// An open port.
pub struct Port {
    name: String,
    stream: Box<dyn Stream>,
}

trait Stream: Read + Write + Send {}
impl<T: Read + Write + Send> Stream for T {}

impl Port {
    /// Opens a port by its name, for `timeout` at most; `baud` (bit/s) applies to serial devices only.
    ///
    /// # Errors
    /// [`simulation::bad_input::BadInput`] if it cannot be opened.
    pub fn open(name: &str, baud: u32, timeout: Duration) -> Result<Self> {
        // Resolving a name, connecting to it and opening a device have no bound on their time.
        let (sender, receiver) = channel();
        let port = name.to_owned();
        thread::spawn(move || sender.send(connect(&port, baud)));
        let late = || io::Error::new(ErrorKind::TimedOut, format!("no connection within {} s", timeout.as_secs_f64()));
        match receiver.recv_timeout(timeout).unwrap_or_else(|_| Err(late())) {
            Ok(stream) => Ok(Self { name: name.to_owned(), stream }),
            Err(error) => {
                bad_input!("{name}: cannot be opened: {error}; expected a serial device, unix:PATH or tcp:HOST:PORT")
            }
        }
    }

    /// Name of the port, as given.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Reads received bytes; returns 0 if none arrive within a few milliseconds.
    ///
    /// # Errors
    /// If the other side has closed the connection.
    pub fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.stream.read(buffer) {
            Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
            Err(error) if is_not_yet(&error) => Ok(0),
            read => read,
        }
    }

    /// Sends all bytes.
    ///
    /// # Errors
    /// If they are not taken within a second, or the other side has closed the connection.
    pub fn write(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        let until = Instant::now() + WRITE;
        while !bytes.is_empty() {
            match self.stream.write(bytes) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(count) => bytes = &bytes[count..],
                // The timeout of a serial device is that of reading.
                Err(error) if is_not_yet(&error) && Instant::now() < until => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

fn is_not_yet(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

fn connect(name: &str, baud: u32) -> io::Result<Box<dyn Stream>> {
    if let Some(path) = name.strip_prefix("unix:") {
        unix(path)
    } else if let Some(address) = name.strip_prefix("tcp:") {
        tcp(address)
    } else {
        serial(name, baud)
    }
}

fn serial(path: &str, baud: u32) -> io::Result<Box<dyn Stream>> {
    // The open port is locked against other programs, which would interfere.
    Ok(Box::new(serialport::new(path, baud).timeout(POLL).open()?))
}

fn tcp(address: &str) -> io::Result<Box<dyn Stream>> {
    let stream = TcpStream::connect(address)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(POLL))?;
    stream.set_write_timeout(Some(WRITE))?;
    Ok(Box::new(stream))
}

#[cfg(unix)]
fn unix(path: &str) -> io::Result<Box<dyn Stream>> {
    let stream = std::os::unix::net::UnixStream::connect(path)?;
    stream.set_read_timeout(Some(POLL))?;
    stream.set_write_timeout(Some(WRITE))?;
    Ok(Box::new(stream))
}

#[cfg(not(unix))]
fn unix(_: &str) -> io::Result<Box<dyn Stream>> {
    Err(ErrorKind::Unsupported.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;
    use std::net::TcpListener;
    use std::sync::{Arc, Mutex};

    /// A device that takes longer than the timeout of its driver: what each attempt to write comes to, and what was written.
    struct Slow {
        attempts: VecDeque<io::Result<usize>>,
        written: Arc<Mutex<Vec<u8>>>,
    }

    impl Read for Slow {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(ErrorKind::TimedOut.into())
        }
    }

    impl Write for Slow {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let count = self.attempts.pop_front().unwrap_or(Ok(bytes.len()))?;
            self.written.lock().unwrap().extend(&bytes[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_frame_is_sent_whole_although_the_device_takes_it_piece_by_piece() {
        let late = || Err(ErrorKind::TimedOut.into());
        let written = Arc::default();
        let attempts = [late(), late(), Ok(1), Err(ErrorKind::Interrupted.into()), late(), Ok(2)].into();
        let stream = Box::new(Slow { attempts, written: Arc::clone(&written) });
        let mut port = Port { name: "slow".to_owned(), stream };
        port.write(&[1, 2, 3, 4, 5]).unwrap();
        assert_eq!(*written.lock().unwrap(), [1, 2, 3, 4, 5]);
        port.stream = Box::new(Slow { attempts: [Ok(1), Ok(0)].into(), written });
        assert_eq!(port.write(&[1, 2]).unwrap_err().kind(), ErrorKind::WriteZero);
    }

    /// A listener that accepts nothing takes as many connections as it may keep waiting; further ones are not answered.
    #[cfg(target_os = "linux")]
    #[test]
    fn the_timeout_also_ends_a_connection_that_nobody_answers() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let connect = |_| TcpStream::connect_timeout(&address, Duration::from_millis(200)).ok();
        let waiting: Vec<TcpStream> = (0..10_000).map_while(connect).collect();
        assert!(waiting.len() < 10_000, "every connection is answered");
        let begin = Instant::now();
        let error = Port::open(&format!("tcp:{address}"), 0, Duration::from_millis(300)).err().unwrap().to_string();
        assert!(begin.elapsed() < Duration::from_secs(20), "{:?}", begin.elapsed());
        let expected = "no connection within 0.3 s; expected a serial device, unix:PATH or tcp:HOST:PORT";
        assert_eq!(error, format!("tcp:{address}: cannot be opened: {expected}"));
    }
}
