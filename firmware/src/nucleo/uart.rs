//! Line to the host: LPUART1, driven by interrupts, with a buffer in each direction.

// For the macros that take a buffer once and bind an interrupt.
#![allow(unsafe_code)]

use cortex_m::singleton;
use embassy_stm32::peripherals::{LPUART1, PA2, PA3};
use embassy_stm32::usart::{self, BufferedUart, Config};
use embassy_stm32::{Peri, bind_interrupts};
use embassy_time::{Duration, with_timeout};
use embedded_io_async::{Read, Write};
use link::frame::MAX_FRAME;

use crate::board::Line;

bind_interrupts!(struct Interrupts {
    LPUART1 => usart::BufferedInterruptHandler<LPUART1>;
});

/// Length of the receive buffer, in bytes: the task may be waiting until a frame has been sent.
const RECEIVED: usize = 2 * MAX_FRAME;
/// Period of the check for free space in the send buffer: the driver's `write` does not wake its task.
const POLL: Duration = Duration::from_millis(1);

/// The line to the host.
pub struct Uart(BufferedUart<'static>);

impl Uart {
    /// Initialises the line with 115 200 bit/s; `None` if it is in use already.
    pub fn new(uart: Peri<'static, LPUART1>, rx: Peri<'static, PA3>, tx: Peri<'static, PA2>) -> Option<Self> {
        let to_send = singleton!(: [u8; MAX_FRAME] = [0; MAX_FRAME])?;
        let received = singleton!(: [u8; RECEIVED] = [0; RECEIVED])?;
        BufferedUart::new(uart, rx, tx, to_send, received, Interrupts, Config::default()).ok().map(Self)
    }
}

impl Line for Uart {
    async fn read(&mut self, buffer: &mut [u8]) -> usize {
        // After an error bytes are missing, and the CRC rejects their frame.
        self.0.read(buffer).await.unwrap_or(0)
    }

    async fn write(&mut self, bytes: &[u8]) {
        // The driver accepts all bytes or none.
        while with_timeout(POLL, self.0.write(bytes)).await.is_err() {}
    }
}
