//! Telemetry as PlotJuggler's UDP server reads it: one JSON object a datagram, its time under `timestamp`.
//!
//! Datagrams are sent without waiting, whether or not anybody receives them: a receiver may come and go, and none of them delays
//! the program that keeps the MCU from detecting a silent host.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs, UdpSocket};
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::Result;
use link::{IsolationReport, Telemetry};
use serde_json::json;
use simulation::bad_input;

use crate::link::{IsolationRow, Row};

/// Default address of PlotJuggler's UDP server.
pub const PLOT_JUGGLER: &str = "127.0.0.1:9870";

/// Sends samples to one receiver.
pub struct Datagrams {
    socket: UdpSocket,
    to: SocketAddr,
    rate_hz: u32,
    /// Tick of the first sample, and its time of day in s since 1970.
    first: Option<(u64, f64)>,
    /// Number of samples that were sent.
    pub sent: u64,
    /// Number of samples that the system did not take.
    pub not_sent: u64,
}

impl Datagrams {
    /// Prepares to send to `address`, `HOST:PORT`, the samples of an MCU with `rate_hz` ticks per second.
    ///
    /// # Errors
    /// [`simulation::BadInput`] if the address is none.
    pub fn to(address: &str, rate_hz: u32) -> Result<Self> {
        let expected = "expected HOST:PORT";
        let to = match address.to_socket_addrs().map(|mut all| all.next()) {
            Ok(Some(to)) => to,
            Ok(None) => bad_input!("--udp {address}: no address; {expected}"),
            Err(error) => bad_input!("--udp {address}: {error}; {expected}"),
        };
        let any: IpAddr = if to.is_ipv4() { Ipv4Addr::UNSPECIFIED.into() } else { Ipv6Addr::UNSPECIFIED.into() };
        let socket = UdpSocket::bind((any, 0)).and_then(|socket| socket.set_nonblocking(true).map(|()| socket));
        match socket {
            Ok(socket) => Ok(Self { socket, to, rate_hz, first: None, sent: 0, not_sent: 0 }),
            Err(error) => bad_input!("--udp {address}: {error}; expected a network to send to"),
        }
    }

    /// Sends a sample with what the isolation bank has said last. Its time is that of the first sample's arrival and the MCU's clock
    /// since then.
    pub fn send(&mut self, sample: &Telemetry, verdict: Option<&IsolationReport>) {
        let now = || SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
        let (tick, start_s) = match self.first {
            // The MCU has restarted.
            Some((tick, _)) if sample.tick < tick => (sample.tick, now()),
            Some(first) => first,
            None => (sample.tick, now()),
        };
        self.first = Some((tick, start_s));
        let timestamp = start_s + (sample.tick - tick) as f64 / f64::from(self.rate_hz.max(1));
        let text = object(sample, verdict, self.rate_hz, timestamp).to_string();
        match self.socket.send_to(text.as_bytes(), self.to) {
            Ok(_) => self.sent += 1,
            Err(_) => self.not_sent += 1,
        }
    }
}

/// The object of a sample. Names of states, limits and verdicts are also there as numbers, which alone can be plotted.
fn object(sample: &Telemetry, verdict: Option<&IsolationReport>, rate_hz: u32, timestamp: f64) -> serde_json::Value {
    let mut row = json!(Row::new(sample, rate_hz));
    row["state_code"] = json!(sample.state as u8);
    row["limit_bits"] = json!(sample.limits);
    if let Some(report) = verdict {
        row["isolation"] = json!(IsolationRow::new(report, rate_hz));
        row["isolation"]["verdict_code"] = json!(report.verdict);
    }
    json!({ "timestamp": timestamp, "vsj": row })
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::{State, WireVolts};
    use serde_json::Value;
    use std::time::Duration;

    #[test]
    fn each_sample_is_an_object_with_a_time_and_a_lost_receiver_stops_nothing() {
        let receiver = UdpSocket::bind("127.0.0.1:0").unwrap();
        receiver.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        let mut datagrams = Datagrams::to(&receiver.local_addr().unwrap().to_string(), 1000).unwrap();
        let sample =
            |tick| Telemetry { tick, state: State::Armed, applied: WireVolts(3 << 19), ..Telemetry::default() };
        let named = IsolationReport { verdict: 0x302, size: 0.5, ..IsolationReport::default() };
        let mut received = |tick, verdict: Option<IsolationReport>| -> Value {
            datagrams.send(&sample(tick), verdict.as_ref());
            let mut bytes = [0; 2048];
            let count = receiver.recv(&mut bytes).unwrap();
            serde_json::from_slice(&bytes[..count]).unwrap()
        };
        let first = received(5000, None);
        let second = received(5250, Some(named));
        let after_s = second["timestamp"].as_f64().unwrap() - first["timestamp"].as_f64().unwrap();
        assert!((after_s - 0.25).abs() < 1e-6, "{after_s}");
        assert_eq!((&second["vsj"]["applied_v"], &second["vsj"]["state_code"]), (&json!(1.5), &json!(1)));
        assert_eq!(first["vsj"].get("isolation"), None, "it has said nothing");
        let said = &second["vsj"]["isolation"];
        assert_eq!((&said["cause"], &said["verdict_code"]), (&json!("time-constant"), &json!(0x302)));
        assert_eq!(said["size"]["value"], json!(0.5));
        assert!(received(3, None)["timestamp"].as_f64() > first["timestamp"].as_f64(), "after a restart");
        drop(receiver);
        for tick in 10..20 {
            datagrams.send(&sample(tick), None);
        }
        assert_eq!(datagrams.sent + datagrams.not_sent, 13);
    }

    #[test]
    fn an_address_without_port_is_refused() {
        for address in ["127.0.0.1", "127.0.0.1:x", ":::"] {
            let error = Datagrams::to(address, 1000).err().unwrap().to_string();
            assert!(
                error.starts_with(&format!("--udp {address}: ")) && error.contains("expected HOST:PORT"),
                "{error}"
            );
        }
    }
}
