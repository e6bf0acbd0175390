//! The requests of a client, one function each.

use link::adaptation::Adaptation;
use link::capture::{Capture, Captured, Row};
use link::isolation::Isolation;
use link::{
    AdaptationReport, Block, BlockId, Blocks, BrownOut, IsolationReport, Part, Reason, Reply, Request, Status,
    WireModel, WireSettings,
};

use crate::client::{Client, status};
use crate::failure::Failure;

impl Client {
    /// Requests the status.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn status(&mut self) -> Result<Status, Failure> {
        status(self.ask(Request::Status)?)
    }

    /// Sends a request that is answered with an acknowledgement; returns the state and target in it.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn order(&mut self, request: Request) -> Result<(link::State, link::WireVolts), Failure> {
        match self.ask(request)? {
            Reply::Ack { state, target } => Ok((state, target)),
            other => Err(Failure::unexpected(other)),
        }
    }

    /// The model that runs now, and the one stored for the next start.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn models(&mut self) -> Result<Blocks, Failure> {
        match self.ask(Request::Model)? {
            Reply::Model(models) => Ok(models),
            other => Err(Failure::unexpected(other)),
        }
    }

    /// Sends a model to be checked and stored, restarts the MCU, connects again, and checks that it runs this model.
    ///
    /// # Errors
    /// [`Failure`]; if the model is rejected, the old one stays. [`Failure::NotRun`] if another one runs.
    pub fn install(&mut self, model: &WireModel) -> Result<Blocks, Failure> {
        self.send(Block::Model, &model.payload().ok_or(Failure::TooLong("the model"))?)
    }

    /// The settings that run now, and those stored for the next start.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn settings(&mut self) -> Result<Blocks, Failure> {
        match self.ask(Request::Settings)? {
            Reply::Settings(blocks) => Ok(blocks),
            other => Err(Failure::unexpected(other)),
        }
    }

    /// Reads the settings that run, or those that are built into the MCU's image.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn read_settings(&mut self, built_in: bool) -> Result<WireSettings, Failure> {
        let mut payload = Vec::new();
        for number in 0..=u8::MAX {
            match self.ask(Request::ReadSettings { built_in, number })? {
                Reply::SettingsPart(Part { number: of, length, bytes }) if of == number => {
                    payload.extend(bytes);
                    if payload.len() >= usize::from(length) {
                        payload.truncate(usize::from(length));
                        break;
                    }
                }
                other => return Err(Failure::unexpected(other)),
            }
        }
        WireSettings::read(&payload).ok_or(Failure::UnknownSettings)
    }

    /// Sends settings to be checked and stored, restarts the MCU, connects again, and checks that it runs them: by their
    /// identity, and value by value.
    ///
    /// # Errors
    /// [`Failure`]; if the settings are rejected, the old ones stay. [`Failure::NotRun`] if others run.
    pub fn install_settings(&mut self, settings: &WireSettings) -> Result<Blocks, Failure> {
        let payload = settings.payload().ok_or(Failure::TooLong("the settings"))?;
        let blocks = self.send(Block::Settings, &payload)?;
        let running = self.read_settings(false)?;
        if running.payload().is_none_or(|running| running != payload) {
            let sent = BlockId::of(blocks.active.number, &payload);
            return Err(Failure::NotRun { what: "settings", sent, blocks });
        }
        Ok(blocks)
    }

    /// What the isolation bank says; `None` if the MCU's program does not know the request.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn isolation(&mut self, request: Isolation) -> Result<Option<IsolationReport>, Failure> {
        match self.ask_newer(Request::Isolation(request))? {
            None => Ok(None),
            Some(Reply::Isolation(report)) => Ok(Some(report)),
            Some(other) => Err(Failure::unexpected(other)),
        }
    }

    /// What the adaptation does; `None` if the MCU's program does not know the request.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn adaptation(&mut self, request: Adaptation) -> Result<Option<AdaptationReport>, Failure> {
        match self.ask_newer(Request::Adaptation(request))? {
            None => Ok(None),
            Some(Reply::Adaptation(report)) => Ok(Some(report)),
            Some(other) => Err(Failure::unexpected(other)),
        }
    }

    /// Level of the brown-out reset; `None` if the MCU's program does not know the request, or the board has no such level.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn brown_out(&mut self) -> Result<Option<BrownOut>, Failure> {
        match self.ask_newer(Request::BrownOut)? {
            None => Ok(None),
            Some(Reply::BrownOut(level)) => Ok(level),
            Some(other) => Err(Failure::unexpected(other)),
        }
    }

    /// The reply to a request that not every program of the MCU knows; `None` if it does not.
    fn ask_newer(&mut self, request: Request) -> Result<Option<Reply>, Failure> {
        match self.ask(request) {
            Err(Failure::Refused(Reason::UnknownRequest)) => Ok(None),
            answer => answer.map(Some),
        }
    }

    /// How far the fast capture is, and for how many rows the MCU has room.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn capture_state(&mut self) -> Result<Captured, Failure> {
        self.ask_capture(Capture::State)
    }

    /// Starts a fast capture of this number of ticks.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn capture(&mut self, rows: u32) -> Result<Captured, Failure> {
        self.ask_capture(Capture::Start { rows })
    }

    fn ask_capture(&mut self, request: Capture) -> Result<Captured, Failure> {
        match self.ask(Request::Capture(request))? {
            Reply::Captured(captured) => Ok(captured),
            other => Err(Failure::unexpected(other)),
        }
    }

    /// Reads rows of the fast capture, from number `first` on; none if it has not come that far. A frame that is damaged
    /// is asked for again.
    ///
    /// # Errors
    /// [`Failure`]
    pub fn rows(&mut self, first: u32) -> Result<Vec<Row>, Failure> {
        match self.ask(Request::Capture(Capture::Read { first }))? {
            Reply::Rows(rows) if rows.first == first => Ok(rows.iter().collect()),
            other => Err(Failure::unexpected(other)),
        }
    }

    /// Sends a block, restarts the MCU, connects again, and checks that it runs the block.
    fn send(&mut self, block: Block, payload: &[u8]) -> Result<Blocks, Failure> {
        for request in Request::sending(block, payload) {
            self.order(request)?;
        }
        self.restart()?;
        let (what, blocks) = match block {
            Block::Model => ("model", self.models()?),
            Block::Settings => ("settings", self.settings()?),
        };
        let sent = BlockId::of(blocks.active.number, payload);
        if blocks.active == BlockId::default() || blocks.active != sent {
            return Err(Failure::NotRun { what, sent, blocks });
        }
        Ok(blocks)
    }
}
