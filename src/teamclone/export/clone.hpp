/// Why a call did not do what it was asked for; `text` says it in words.
enum class Status { ok, no_file, not_weights, other_format, damaged, no_memory, not_loaded, no_state, no_such_player, other_rules };

/// What a status means.
inline const char* text(Status status) {
    switch (status) {
        case Status::ok: return "done";
        case Status::no_file: return "the file of the weights cannot be read";
        case Status::not_weights: return "these are no weights of a network: they do not begin with TCLONENN";
        case Status::other_format: return "the weights are of another format than this header: export both again";
        case Status::damaged: return "the weights are damaged: export them again";
        case Status::no_memory: return "there is not enough memory";
        case Status::not_loaded: return "there are no weights yet: call load";
        case Status::no_state: return "there is no state yet: call see";
        case Status::no_such_player: return "the player is none of 0 to 10, or is not on the field";
        case Status::other_rules: return "the server has other rules for kicks than plans are made for: ball_size, maxpower, ball_accel_max, ball_speed_max";
    }
    return "unknown";
}

/// The ball: metres and metres per cycle, as a log has them: velocities after decay.
struct Ball {
    float x = 0, y = 0, vx = 0, vy = 0;
};

/// One frame: the ball, and the players, the modelled team's eleven first. The team attacks towards +x.
struct Moment {
    Ball ball;
    Player players[N_PLAYERS];
};

/// What a team sees of one cycle.
struct State {
    Moment now;
    Moment past[PAST_FRAMES];               ///< one, two, ... cycles before; only some networks look at them
    bool past_known[PAST_FRAMES] = {};      ///< whether play had already begun then
    PlayerType types[N_PLAYERS];            ///< each player's own; the default type unless it is set
    Server server;                          ///< the server's parameters; its defaults unless they are set
    int mode = MODE_PLAY_ON;                ///< as if the modelled team were the left one: MODE_KICK_IN_L is its own kick-in
    float mode_cycles = 0;                  ///< cycles since this mode began, 0 in its first
};

/// A command: its place in the command set, and its numbers in power, degrees and metres, 0 for those that it lacks.
struct Action {
    int command = 0;
    double numbers[2] = {0, 0};
};

/// The clone of a team. It has room for one answer: one thread at a time may use it. Nothing is allocated after `load`.
class Clone {
  public:
    using Answer = engine_network_result::Answer;

    /// Load the weights from a file.
    Status load(const char* path) {
        std::FILE* file = std::fopen(path, "rb");
        if (file == nullptr) return Status::no_file;
        std::fseek(file, 0, SEEK_END);
        const long size = std::ftell(file);
        std::rewind(file);
        if (size < 0) return std::fclose(file), Status::no_file;
        const Room<unsigned char> bytes(new (std::nothrow) unsigned char[static_cast<std::size_t>(size) + 1]);
        const std::size_t read = bytes ? std::fread(bytes.get(), 1, static_cast<std::size_t>(size), file) : 0;
        std::fclose(file);
        if (!bytes) return Status::no_memory;
        return read == static_cast<std::size_t>(size) ? load(bytes.get(), read) : Status::no_file;
    }

    /// Load the weights from memory, which may be given back afterwards. The machine is little-endian.
    Status load(const unsigned char* bytes, std::size_t size) {
        loaded_ = seen_ = answered_ = false;
        constexpr std::size_t START = 16, COUNTS = 48;
        if (size < START + COUNTS || std::memcmp(bytes, "TCLONENN", 8) != 0) return Status::not_weights;
        std::uint32_t number, sum;
        std::memcpy(&number, bytes + 8, 4);
        std::memcpy(&sum, bytes + 12, 4);
        if (number != WEIGHTS_FORMAT) return Status::other_format;
        if (crc(bytes + START, size - START) != sum) return Status::damaged;
        std::int64_t lengths[4];
        std::memcpy(model_, bytes + START, 16);
        std::memcpy(lengths, bytes + START + 16, sizeof lengths);
        constexpr std::int64_t SIZES[4] = {8, 8, 4, 1};
        std::uint64_t whole = START + COUNTS;
        for (int part = 0; part < 4; ++part) {
            if (lengths[part] < 0 || lengths[part] > static_cast<std::int64_t>(size)) return Status::damaged;
            whole += static_cast<std::uint64_t>(lengths[part] * SIZES[part]);
        }
        if (whole != size || lengths[0] < N_FIELDS || lengths[1] < 1 || (lengths[3] != 0 && lengths[3] != ORDER)) return Status::damaged;
        n_spec_ = lengths[0];
        n_inputs_ = lengths[1];
        const unsigned char* at = bytes + START + COUNTS;
        if (!keep(spec_, at, lengths[0]) || !keep(inputs_, at, lengths[1]) || !keep(values_, at, lengths[2])) return Status::no_memory;
        n_values_ = lengths[2];
        return ready(lengths[3] != 0, at);
    }

    /// Look at a cycle, for the answers that follow.
    Status see(const State& state) {
        seen_ = answered_ = false;
        if (!loaded_) return Status::not_loaded;
        if (planned_ && !usual(state.server)) return Status::other_rules;
        copy(state.now, ball_, players_);
        for (int back = 0; back < PAST_FRAMES; ++back) copy(state.past[back], past_ball_ + 4 * back, past_players_ + N_PLAYERS * N_CHANNELS * back);
        for (int back = 0; back < PAST_FRAMES; ++back) past_known_[back] = state.past_known[back];
        std::memcpy(types_, state.types, sizeof types_);
        std::memcpy(server_, &state.server, sizeof server_);
        mode_ = state.mode < 0 || state.mode > 255 ? 0 : state.mode;
        mode_cycles_ = state.mode_cycles;
        const bool made = fill_frame(memory_, frame_, {ball_, {4}}, {players_, {N_PLAYERS, N_CHANNELS}}, {types_, {N_PLAYERS, N_TYPE}}, {server_, {N_SERVER}});
        seen_ = made;
        return made ? Status::ok : Status::no_memory;
    }

    /// Answer for a player of the team, 0 to 10, in the cycle that was seen last.
    Status answer(int player) {
        answered_ = false;
        if (!loaded_) return Status::not_loaded;
        if (!seen_) return Status::no_state;
        if (player < 0 || player >= N_TEAM || frame_.scene(player, PRESENT) == 0) return Status::no_such_player;
        const rt::View<float, 1> packed(packed_.get(), {spec_[N_NETWORK_INPUTS]});
        bool near = true, made = false;
        if (inputs_[0] == PAPER) {
            made = fill_paper(memory_, frames(), 0, player, {inputs_.get() + 1, {n_inputs_ - 1}}, packed);
        } else {
            made = fill_inputs(memory_, frames(), 0, frame_, player, {order_.get(), {DIRECTIONS, PAIRS, 2}}, {inputs_.get() + 1, {n_inputs_ - 1}}, packed, near);
        }
        made = made && fill_answer(memory_, values(), spec(), packed, near, {out_.get(), {spec_[N_OUT]}});
        answered_ = made;
        near_ = near;
        return made ? Status::ok : Status::no_memory;
    }

    /// Id of the model, as in contract.json.
    const char* model_id() const { return model_; }
    /// The number of commands that the clone knows.
    int commands() const { return loaded_ ? static_cast<int>(spec_[COMMANDS]) : 0; }
    /// The name of a command.
    const char* command(int place) const {
        if (!loaded_ || place < 0 || place >= commands()) return "";
        if (place < 4) return CLONED[place];
        return place == spec_[CATCH] ? "catch" : place == spec_[MOVE] ? "move" : "none";
    }

    // Of the last answer; without one all is zero or empty.

    /// Whether the player may reach the ball with a kick or a tackle; else their numbers are 0.
    bool near_the_ball() const { return answered_ && near_; }
    /// The probability of a command.
    float probability(int place) const { return answered_ && place >= 0 && place < commands() ? out_[static_cast<std::size_t>(spec_[PROBABILITIES_AT] + place)] : 0; }
    /// The most probable command, with its single best numbers.
    Action likeliest() {
        Action made;
        if (!answered_) return made;
        rt::Int place = 0;
        if (!likeliest_of(memory_, distribution(), place)) return made;
        return point(static_cast<int>(place));
    }
    /// A command with its single best numbers.
    Action point(int place) {
        Action made;
        made.command = place;
        if (answered_ && place >= 0 && place < commands()) static_cast<void>(point_of(memory_, spec(), distribution(), place, {made.numbers, {2}}));
        return made;
    }
    /// A command drawn by UNIFORMS random numbers in [0, 1).
    Action sample(const double (&uniforms)[UNIFORMS]) {
        Action made;
        if (!answered_) return made;
        double given[UNIFORMS];
        for (int index = 0; index < UNIFORMS; ++index) given[index] = uniforms[index] >= 0 && uniforms[index] < 1 ? uniforms[index] : 0;
        rt::Int place = 0;
        if (sample_of(memory_, spec(), {out_.get(), {spec_[N_OUT]}}, {given, {UNIFORMS}}, {made.numbers, {2}}, place)) made.command = static_cast<int>(place);
        return made;
    }
    /// The distribution of every parameter, as views into the clone; empty without an answer.
    Answer distribution() {
        Answer made{};
        if (answered_) static_cast<void>(view_of(memory_, spec(), {out_.get(), {spec_[N_OUT]}}, made));
        return made;
    }

  private:
    template <typename T> using Room = std::unique_ptr<T[]>;
    static constexpr rt::Int ORDER = DIRECTIONS * PAIRS * 2;

    template <typename T> static bool make(Room<T>& room, rt::Int count) {
        room.reset(new (std::nothrow) T[static_cast<std::size_t>(count) + 1]());
        return room != nullptr;
    }
    template <typename T> static bool keep(Room<T>& room, const unsigned char*& at, std::int64_t count) {
        if (!make(room, count)) return false;
        std::memcpy(room.get(), at, static_cast<std::size_t>(count) * sizeof(T));
        at += static_cast<std::size_t>(count) * sizeof(T);
        return true;
    }
    static std::uint32_t crc(const unsigned char* bytes, std::size_t size) {
        std::uint32_t table[8][256];
        for (std::uint32_t byte = 0; byte < 256; ++byte) {
            std::uint32_t value = byte;
            for (int bit = 0; bit < 8; ++bit) value = (value >> 1) ^ (0xEDB88320u & (0u - (value & 1u)));
            table[0][byte] = value;
        }
        for (std::uint32_t byte = 0; byte < 256; ++byte)
            for (int slice = 1; slice < 8; ++slice) table[slice][byte] = (table[slice - 1][byte] >> 8) ^ table[0][table[slice - 1][byte] & 255u];
        std::uint32_t sum = 0xFFFFFFFFu;
        std::size_t at = 0;
        for (; at + 8 <= size; at += 8) {  // eight bytes at a time
            std::uint32_t one, two;
            std::memcpy(&one, bytes + at, 4);
            std::memcpy(&two, bytes + at + 4, 4);
            one ^= sum;
            sum = table[7][one & 255u] ^ table[6][(one >> 8) & 255u] ^ table[5][(one >> 16) & 255u] ^ table[4][one >> 24] ^ table[3][two & 255u] ^
                  table[2][(two >> 8) & 255u] ^ table[1][(two >> 16) & 255u] ^ table[0][two >> 24];
        }
        for (; at < size; ++at) sum = (sum >> 8) ^ table[0][(sum ^ bytes[at]) & 255u];
        return ~sum;
    }

    Status ready(bool planned, const unsigned char* order) {
        rt::Int fault = 0;
        planned_ = planned;
        if (!make(scratch_, MEMORY_BYTES) || !make(order_, ORDER) || !make(frame_numbers_, FRAME_NUMBERS)) return Status::no_memory;
        for (rt::Int index = 0; planned && index < ORDER; ++index) order_[static_cast<std::size_t>(index)] = order[index] < PLACES ? order[index] : 0;
        memory_ = rt::Memory(scratch_.get(), MEMORY_BYTES);
        if (!fault_of(memory_, spec(), {inputs_.get(), {n_inputs_}}, n_values_, fault)) return Status::no_memory;
        if (fault != 0) return Status::damaged;
        if (!make(packed_, spec_[N_NETWORK_INPUTS]) || !make(out_, spec_[N_OUT])) return Status::no_memory;
        double* at = frame_numbers_.get();
        const auto take = [&at](rt::Int count) { return (at += count) - count; };
        frame_.scene = {take(ROWS * COLUMNS), {ROWS, COLUMNS}};
        frame_.more = {take(N_PLAYERS * MORE), {N_PLAYERS, MORE}};
        frame_.lines = {take(2), {2}};
        frame_.path = {take(2 * (REACH_CYCLES + 1) * 2), {2, REACH_CYCLES + 1, 2}};
        frame_.steps = {take(2 * N_PLAYERS), {2, N_PLAYERS}};
        frame_.known = {known_, {2}};
        loaded_ = true;
        return Status::ok;
    }
    static void copy(const Moment& moment, float* ball, float* players) {
        std::memcpy(ball, &moment.ball, 4 * sizeof(float));
        std::memcpy(players, moment.players, N_PLAYERS * N_CHANNELS * sizeof(float));
    }
    static bool usual(const Server& server) {
        const Server usual;
        return server.ball_size == usual.ball_size && server.maxpower == usual.maxpower && server.ball_accel_max == usual.ball_accel_max &&
               server.ball_speed_max == usual.ball_speed_max;
    }
    rt::View<rt::Int, 1> spec() const { return {spec_.get(), {n_spec_}}; }
    rt::View<float, 1> values() const { return {values_.get(), {n_values_}}; }
    engine_inputs_project::Frames frames() {
        return {{ball_, {1, 4}}, {players_, {1, N_PLAYERS, N_CHANNELS}}, {types_, {1, N_PLAYERS, N_TYPE}}, {server_, {1, N_SERVER}}, {past_ball_, {1, PAST_FRAMES, 4}},
                {past_players_, {1, PAST_FRAMES, N_PLAYERS, N_CHANNELS}}, {past_known_, {1, PAST_FRAMES}}, {&mode_, {1}}, {&mode_cycles_, {1}}};
    }

    bool loaded_ = false, seen_ = false, answered_ = false, near_ = false, planned_ = false;
    char model_[17] = {};
    Room<rt::Int> spec_, inputs_, order_;
    Room<float> values_, packed_, out_;
    Room<double> frame_numbers_;
    Room<unsigned char> scratch_;
    rt::Int n_spec_ = 0, n_inputs_ = 0, n_values_ = 0, mode_ = 0;
    rt::Memory memory_{nullptr, 0};
    engine_inputs_frame::Frame frame_{};
    bool known_[2] = {}, past_known_[PAST_FRAMES] = {};
    float ball_[4] = {}, players_[N_PLAYERS * N_CHANNELS] = {}, types_[N_PLAYERS * N_TYPE] = {}, server_[N_SERVER] = {}, mode_cycles_ = 0;
    float past_ball_[PAST_FRAMES * 4] = {}, past_players_[PAST_FRAMES * N_PLAYERS * N_CHANNELS] = {};
};
