// What translated kernels need: arrays that are views, scratch memory of a fixed size, and the operations of Python,
// NumPy and Numba where those of C++ differ. Nothing here throws, allocates or keeps state.
namespace rt {

using Int = std::int64_t;

constexpr double INF = std::numeric_limits<double>::infinity();
constexpr double NOT_A_NUMBER = std::numeric_limits<double>::quiet_NaN();

// With TEAMCLONE_CHECKED defined, a place outside an array ends the program with its file and line.
#ifdef TEAMCLONE_CHECKED
#define TEAMCLONE_CHECK(holds) ((holds) ? void() : ::teamclone::TEAMCLONE_VERSION::rt::broken(#holds, __FILE__, __LINE__))
[[noreturn]] inline void broken(const char* what, const char* file, int line) {
    std::fprintf(stderr, "%s:%d: expected %s\n", file, line, what);
    std::abort();
}
#else
#define TEAMCLONE_CHECK(holds) static_cast<void>(0)
#endif

// ---- Numbers: integers wrap around, division by zero gives what NumPy gives.

constexpr std::uint64_t bits(Int value) { return static_cast<std::uint64_t>(value); }
constexpr Int add(Int a, Int b) { return static_cast<Int>(bits(a) + bits(b)); }
constexpr Int sub(Int a, Int b) { return static_cast<Int>(bits(a) - bits(b)); }
constexpr Int mul(Int a, Int b) { return static_cast<Int>(bits(a) * bits(b)); }
constexpr std::uint64_t add(std::uint64_t a, std::uint64_t b) { return a + b; }
constexpr std::uint64_t sub(std::uint64_t a, std::uint64_t b) { return a - b; }
constexpr std::uint64_t mul(std::uint64_t a, std::uint64_t b) { return a * b; }
constexpr double add(double a, double b) { return a + b; }
constexpr float add(float a, float b) { return a + b; }
constexpr Int neg(Int a) { return static_cast<Int>(-bits(a)); }
constexpr Int abs(Int a) { return a < 0 ? neg(a) : a; }
inline double abs(double a) { return std::fabs(a); }
inline float abs(float a) { return std::fabs(a); }
constexpr Int shift_left(Int a, Int b) { return static_cast<Int>(bits(a) << (bits(b) & 63)); }
constexpr Int shift_right(Int a, Int b) { return a >> (bits(b) & 63); }
constexpr std::uint64_t shift_left(std::uint64_t a, Int b) { return a << (bits(b) & 63); }
constexpr std::uint64_t shift_right(std::uint64_t a, Int b) { return a >> (bits(b) & 63); }
constexpr std::uint64_t floor_div(std::uint64_t a, std::uint64_t b) { return b == 0 ? 0 : a / b; }
constexpr std::uint64_t floor_mod(std::uint64_t a, std::uint64_t b) { return b == 0 ? 0 : a % b; }
constexpr bool both(bool a, bool b) { return a && b; }
constexpr bool either(bool a, bool b) { return a || b; }
constexpr bool differ(bool a, bool b) { return a != b; }

template <typename T> constexpr bool is_nan(T a) { return a != a; }

/// A float as an integer, cut towards zero; the smallest integer for what has none.
inline Int to_int(double a) {
    return a >= -0x1p63 && a < 0x1p63 ? static_cast<Int>(a) : std::numeric_limits<Int>::min();
}
inline Int to_int(float a) { return to_int(static_cast<double>(a)); }

constexpr bool has_quotient(Int a, Int b) { return b != 0 && !(b == -1 && a == std::numeric_limits<Int>::min()); }
constexpr Int floor_div(Int a, Int b) {
    if (!has_quotient(a, b)) return 0;
    const Int rest = a % b;
    return a / b - (rest != 0 && (rest ^ b) < 0 ? 1 : 0);
}
constexpr Int floor_mod(Int a, Int b) {
    if (!has_quotient(a, b)) return 0;
    const Int rest = a % b;
    return rest != 0 && (rest ^ b) < 0 ? rest + b : rest;
}

template <typename T> T float_mod(T a, T b) {
    const T rest = std::fmod(a, b);
    if (b == T(0)) return rest;
    if (rest == T(0)) return b < T(0) ? -T(0) : T(0);
    return (b < T(0)) != (rest < T(0)) ? rest + b : rest;
}
template <typename T> T float_div(T a, T b) {
    if (b == T(0)) return a / b;
    const T rest = std::fmod(a, b);
    T quotient = (a - rest) / b;
    if (rest != T(0) && (b < T(0)) != (rest < T(0))) quotient -= T(1);
    if (quotient == T(0) || is_nan(quotient)) return quotient * quotient * a / b;
    const T whole = std::floor(quotient);
    return quotient - whole > T(0.5) ? whole + T(1) : whole;
}
inline double floor_mod(double a, double b) { return float_mod(a, b); }
inline float floor_mod(float a, float b) { return float_mod(a, b); }
inline double floor_div(double a, double b) { return float_div(a, b); }
inline float floor_div(float a, float b) { return float_div(a, b); }

template <typename T> T int_power(T base, std::uint64_t exponent) {
    T made = T(1);
    for (; exponent != 0; exponent >>= 1) {
        if (exponent & 1) made *= base;
        base *= base;
    }
    return made;
}
constexpr Int MOST_MULTIPLIED = 0x10000;
template <typename T> T float_power(T base, Int exponent) {
    const Int times = abs(exponent);
    if (times > MOST_MULTIPLIED) return std::pow(base, static_cast<T>(exponent));
    const T made = int_power(base, bits(times));
    return exponent < 0 ? T(1) / made : made;
}
inline Int power(Int base, Int exponent) {
    const Int times = abs(exponent);
    if (exponent < 0 && base == 0) return std::numeric_limits<Int>::min();
    if (exponent < 0 && base != 1 && base != -1) return 0;
    if (times > MOST_MULTIPLIED) return to_int(std::pow(static_cast<double>(base), static_cast<double>(exponent)));
    return static_cast<Int>(int_power(bits(base), bits(times)));
}
inline double power(double base, Int exponent) { return float_power(base, exponent); }
inline float power(float base, Int exponent) { return float_power(base, exponent); }
inline double power(double base, double exponent) { return std::pow(base, exponent); }
inline float power(float base, float exponent) { return std::pow(base, exponent); }

/// Python's min and max: a comparison with NaN is false, so the first one stays.
template <typename T> constexpr T min(T a, T b) { return b < a ? b : a; }
template <typename T> constexpr T max(T a, T b) { return b > a ? b : a; }
template <typename T, typename... More> constexpr T min(T a, T b, More... more) { return min<T>(min<T>(a, b), more...); }
template <typename T, typename... More> constexpr T max(T a, T b, More... more) { return max<T>(max<T>(a, b), more...); }
/// NumPy's: NaN if one of them is.
template <typename T> constexpr T minimum(T a, T b) { return is_nan(a) ? a : is_nan(b) || !(a <= b) ? b : a; }
template <typename T> constexpr T maximum(T a, T b) { return is_nan(a) ? a : is_nan(b) || !(a >= b) ? b : a; }

constexpr double RADIANS = 0.017453292519943295, DEGREES = 57.29577951308232;
constexpr double radians(double a) { return a * RADIANS; }
constexpr float radians(float a) { return a * static_cast<float>(RADIANS); }
constexpr double degrees(double a) { return a * DEGREES; }
constexpr float degrees(float a) { return a * static_cast<float>(DEGREES); }

// ---- Tuples.

template <typename T, std::size_t N> using Same = std::array<T, N>;
template <typename... T> using Mixed = std::tuple<T...>;

/// Where an index points to: negative ones count from the end.
constexpr Int wrap(Int index, Int size) { return index < 0 ? index + size : index; }

template <typename T, std::size_t N> constexpr const T& pick(const Same<T, N>& of, Int index) {
    const Int place = wrap(index, static_cast<Int>(N));
    TEAMCLONE_CHECK(place >= 0 && place < static_cast<Int>(N));
    return of[static_cast<std::size_t>(place)];
}

// ---- Arrays: views of memory that others keep. Packed ones lie in memory without gaps, last index first.

template <int N> using Shape = std::array<Int, static_cast<std::size_t>(N)>;

template <std::size_t N> constexpr Int product(const std::array<Int, N>& shape) {
    Int made = 1;
    for (std::size_t axis = 0; axis < N; ++axis) made *= shape[axis];
    return made;
}

template <typename T, int N, bool Packed = true> struct View {
    T* data = nullptr;
    Shape<N> shape{};
    Shape<Packed ? 0 : N> steps{};

    constexpr View() = default;
    constexpr View(T* memory, const Shape<N>& sizes) : data(memory), shape(sizes) {
        static_assert(Packed, "a view with gaps needs its steps");
    }
    constexpr View(T* memory, const Shape<N>& sizes, const Shape<N>& by) : data(memory), shape(sizes) {
        if constexpr (Packed) static_cast<void>(by); else steps = by;
    }
    template <typename U, bool P, typename = std::enable_if_t<std::is_convertible_v<U (*)[], T (*)[]> && (P || !Packed)>>
    constexpr View(const View<U, N, P>& other) : data(other.data), shape(other.shape) {
        if constexpr (!Packed) for (int axis = 0; axis < N; ++axis) steps[at(axis)] = other.step(axis);
    }

    static constexpr std::size_t at(int axis) { return static_cast<std::size_t>(axis); }
    constexpr Int size() const { return product(shape); }
    constexpr Int step(int axis) const {
        if constexpr (Packed) {
            Int made = 1;
            for (int later = axis + 1; later < N; ++later) made *= shape[at(later)];
            return made;
        } else {
            return steps[at(axis)];
        }
    }
    /// The element at indices that are not negative.
    template <typename... Index> constexpr T& operator()(Index... index) const {
        static_assert(sizeof...(Index) == N, "one index for each axis");
        const Shape<N> place{static_cast<Int>(index)...};
        Int offset = 0;
        for (int axis = 0; axis < N; ++axis) {
            TEAMCLONE_CHECK(place[at(axis)] >= 0 && place[at(axis)] < shape[at(axis)]);
            if constexpr (Packed) offset = offset * shape[at(axis)] + place[at(axis)];
            else offset += place[at(axis)] * steps[at(axis)];
        }
        return data[offset];
    }
    /// The element at any indices.
    template <typename... Index> constexpr T& wrapped(Index... index) const {
        return wrapped_at(std::make_integer_sequence<int, N>(), index...);
    }
    template <int... Axis, typename... Index>
    constexpr T& wrapped_at(std::integer_sequence<int, Axis...>, Index... index) const {
        return (*this)(wrap(static_cast<Int>(index), shape[at(Axis)])...);
    }
};

// ---- Scratch memory. A function that returns no array works with a copy of its caller's arena, and so leaves nothing
// behind; one that does takes what it makes from the caller's own.

/// The memory that arenas give out, and where to go on when it is used up.
struct Memory {
    unsigned char* begin;
    unsigned char* end;
    unsigned char* most;  ///< how far it was used, kept up to date where TEAMCLONE_CHECKED is defined
    std::jmp_buf full;

    static constexpr std::size_t ALIGNED = 32;

    Memory(unsigned char* from, std::size_t size) : begin(from), end(from + size), most(from), full() {
        const std::size_t off = reinterpret_cast<std::uintptr_t>(from) % ALIGNED;
        if (off != 0) begin += size < ALIGNED - off ? size : ALIGNED - off;
    }
};

struct Arena {
    unsigned char* next;
    Memory* memory;

    explicit Arena(Memory& of) : next(of.begin), memory(&of) {}

    template <typename T> T* take(Int count) {
        static_assert(alignof(T) <= Memory::ALIGNED && std::is_trivially_destructible_v<T>, "arrays are of plain numbers");
        const Int room = memory->end - next, bytes = count * static_cast<Int>(sizeof(T));
        if (count < 0 || count > room / static_cast<Int>(sizeof(T)) || rounded(bytes) > room) std::longjmp(memory->full, 1);
        T* made = reinterpret_cast<T*>(next);
        next += rounded(bytes);
#ifdef TEAMCLONE_CHECKED
        if (next > memory->most) memory->most = next;
#endif
        return made;
    }
    static constexpr Int rounded(Int bytes) {
        constexpr Int whole = static_cast<Int>(Memory::ALIGNED);
        return (bytes + whole - 1) / whole * whole;
    }
};

/// Run a body with an arena over the memory; false where the memory did not suffice.
template <typename Body> bool within(Memory& memory, const Body& body) {
    if (setjmp(memory.full) != 0) return false;
    body(Arena(memory));
    return true;
}

template <typename T, int N> View<T, N> empty(Arena& arena, const Shape<N>& shape) {
    for (const Int size : shape) if (size < 0) std::longjmp(arena.memory->full, 1);
    return {arena.take<T>(product(shape)), shape};
}
template <typename T, int N> View<T, N> full(Arena& arena, const Shape<N>& shape, T value) {
    const View<T, N> made = empty<T, N>(arena, shape);
    for (Int place = 0, size = made.size(); place < size; ++place) made.data[place] = value;
    return made;
}

// ---- Parts of arrays.

constexpr Int OPEN = std::numeric_limits<Int>::min();

/// A slice; OPEN where it has no start or stop.
struct Slice {
    Int start = OPEN, stop = OPEN, step = 1;
};
/// An axis of size 1 that an array has not.
struct NewAxis {};

/// Start and number of elements of a slice of so many.
constexpr std::pair<Int, Int> range_of(const Slice& slice, Int size) {
    const Int least = slice.step < 0 ? -1 : 0, most = slice.step < 0 ? size - 1 : size;
    Int start = slice.start == OPEN ? (slice.step < 0 ? most : least) : wrap(slice.start, size);
    Int stop = slice.stop == OPEN ? (slice.step < 0 ? least : most) : wrap(slice.stop, size);
    start = start < least ? least : start > most ? most : start;
    stop = stop < least ? least : stop > most ? most : stop;
    const Int span = slice.step < 0 ? start - stop : stop - start, stride = abs(slice.step);
    return {start, span <= 0 || stride == 0 ? 0 : (span + stride - 1) / stride};
}

/// How many axes an index takes of an array, and how many it gives.
template <typename Index> constexpr int TAKES = std::is_same_v<Index, NewAxis> ? 0 : 1;
template <typename Index> constexpr int GIVES = std::is_same_v<Index, Slice> || std::is_same_v<Index, NewAxis> ? 1 : 0;

template <typename T, int N, bool P, int M> struct Cut {
    const View<T, N, P>& of;
    T* data;
    Shape<M> shape{}, steps{};
    int axis = 0, made = 0;

    constexpr void give(Int size, Int step) {
        shape[static_cast<std::size_t>(made)] = size;
        steps[static_cast<std::size_t>(made++)] = step;
    }
    constexpr Int size() const { return of.shape[static_cast<std::size_t>(axis)]; }
    constexpr void apply(Int index) {
        const Int place = wrap(index, size());
        TEAMCLONE_CHECK(place >= 0 && place < size());
        data += place * of.step(axis++);
    }
    constexpr void apply(const Slice& slice) {
        const auto [start, count] = range_of(slice, size());
        if (count > 0) data += start * of.step(axis);
        give(count, of.step(axis) * slice.step);
        ++axis;
    }
    constexpr void apply(NewAxis) { give(1, 0); }
};

/// The part of an array that indices, slices and new axes choose; Packed where it is known to be without gaps.
template <bool Packed, typename T, int N, bool P, typename... Index> constexpr auto part(const View<T, N, P>& of, Index... index) {
    constexpr int taken = (TAKES<Index> + ... + 0), given = (GIVES<Index> + ... + 0);
    constexpr int rank = given + N - taken;
    Cut<T, N, P, rank> cut{of, of.data};
    (cut.apply(index), ...);
    for (; cut.axis < N; ++cut.axis) cut.give(cut.size(), of.step(cut.axis));
    return View<T, rank, Packed>(cut.data, cut.shape, cut.steps);
}

/// A packed array in another shape, of which one size may be -1: what is left for it.
template <typename T, int N, std::size_t M> constexpr View<T, static_cast<int>(M)> reshape(const View<T, N>& of, std::array<Int, M> shape) {
    for (std::size_t axis = 0; axis < M; ++axis) {
        const Int others = shape[axis] < 0 ? -product(shape) : 0;
        if (shape[axis] < 0) { shape[axis] = 1; shape[axis] = others == 0 ? 0 : of.size() / abs(product(shape)); }
    }
    TEAMCLONE_CHECK(product(shape) == of.size());
    return {of.data, shape};
}

template <typename T> constexpr View<T, 2, false> transpose(const View<T, 2, true>& of) {
    return {of.data, {of.shape[1], of.shape[0]}, {of.step(1), of.step(0)}};
}
template <typename T> constexpr View<T, 2, false> transpose(const View<T, 2, false>& of) {
    return {of.data, {of.shape[1], of.shape[0]}, {of.step(1), of.step(0)}};
}

// ---- Element by element, with broadcasting.

/// Where an operand of an array operation is: steps are 0 along the axes over which it is repeated.
template <typename T, int M> struct Cursor {
    T* data;
    Shape<M> steps;
    constexpr T& at(int axis, Int index) const { return data[index * steps[static_cast<std::size_t>(axis)]]; }
    constexpr Cursor moved(int axis, Int index) const { return {&at(axis, index), steps}; }
};
template <typename T> struct Scalar {
    T value;
    constexpr T at(int, Int) const { return value; }
    constexpr Scalar moved(int, Int) const { return *this; }
};

template <int M, typename T, int N, bool P> constexpr Cursor<T, M> cursor(const View<T, N, P>& of) {
    static_assert(N <= M, "an operand has no more axes than the result");
    Cursor<T, M> made{of.data, {}};
    for (int axis = 0; axis < N; ++axis) {
        const bool repeated = of.shape[static_cast<std::size_t>(axis)] == 1;
        made.steps[static_cast<std::size_t>(axis + M - N)] = repeated ? 0 : of.step(axis);
    }
    return made;
}
template <int M, typename T, typename = std::enable_if_t<std::is_arithmetic_v<T>>> constexpr Scalar<T> cursor(T value) {
    return {value};
}

template <int M, typename T, int N, bool P> constexpr void broaden(Shape<M>& shape, const View<T, N, P>& of) {
    for (int axis = 0; axis < N; ++axis) {
        Int& size = shape[static_cast<std::size_t>(axis + M - N)];
        const Int own = of.shape[static_cast<std::size_t>(axis)];
        TEAMCLONE_CHECK(size == 1 || own == 1 || size == own);
        if (size == 1 || (own != 1 && own < size)) size = own;
    }
}
template <int M, typename T> constexpr std::enable_if_t<std::is_arithmetic_v<T>> broaden(Shape<M>&, T) {}

template <int Axis, int M, typename Out, typename F, typename... Operand>
constexpr void fill(const Shape<M>& shape, const Out& out, const F& of, const Operand&... operand) {
    const Int size = shape[static_cast<std::size_t>(Axis)];
    for (Int index = 0; index < size; ++index) {
        if constexpr (Axis == M - 1) out.at(Axis, index) = of(operand.at(Axis, index)...);
        else fill<Axis + 1, M>(shape, out.moved(Axis, index), of, operand.moved(Axis, index)...);
    }
}

/// Fill an array with a function of operands: arrays that are broadcast to its shape, and numbers.
template <typename T, int M, bool P, typename F, typename... Operand>
constexpr void map_into(const View<T, M, P>& out, const F& of, const Operand&... operand) {
    Shape<M> shape = out.shape;
    (broaden<M>(shape, operand), ...);
    TEAMCLONE_CHECK(shape == out.shape);
    fill<0, M>(shape, Cursor<T, M>(cursor<M>(out)), of, cursor<M>(operand)...);
}
template <typename T, int M, typename F, typename... Operand>
View<T, M> map(Arena& arena, const F& of, const Operand&... operand) {
    Shape<M> shape{};
    shape.fill(1);
    (broaden<M>(shape, operand), ...);
    const View<T, M> made = empty<T, M>(arena, shape);
    fill<0, M>(shape, cursor<M>(made), of, cursor<M>(operand)...);
    return made;
}
template <typename T, int N, bool P> constexpr void fill_with(const View<T, N, P>& out, T value) {
    map_into(out, [](T of) { return of; }, value);
}
template <typename T, int N, bool P, int M, bool Q, typename U> constexpr void copy_into(const View<T, N, P>& out, const View<U, M, Q>& of) {
    map_into(out, [](U value) { return static_cast<T>(value); }, of);
}
template <typename T, int N, bool P> View<std::remove_const_t<T>, N> copy(Arena& arena, const View<T, N, P>& of) {
    return map<std::remove_const_t<T>, N>(arena, [](T value) { return value; }, of);
}
template <typename U, typename T, int N, bool P> View<U, N> as(Arena& arena, const View<T, N, P>& of) {
    return map<U, N>(arena, [](T value) { return static_cast<U>(value); }, of);
}

// ---- Over all elements.

/// Give all elements in their order to a function until it returns false; whether it never did.
template <int Axis, typename T, int N, bool P, typename F> constexpr bool each_from(const View<T, N, P>& of, T* data, F& each) {
    for (Int index = 0; index < of.shape[static_cast<std::size_t>(Axis)]; ++index) {
        T* element = data + index * of.step(Axis);
        if constexpr (Axis == N - 1) { if (!each(*element)) return false; }
        else { if (!each_from<Axis + 1>(of, element, each)) return false; }
    }
    return true;
}
template <typename T, int N, bool P, typename F> constexpr bool each(const View<T, N, P>& of, F each) {
    return each_from<0>(of, of.data, each);
}

template <typename T, int N, bool P> constexpr bool all(const View<T, N, P>& of) {
    return each(of, [](T value) { return value != T(0); });
}
template <typename T, int N, bool P> constexpr bool any(const View<T, N, P>& of) {
    return !each(of, [](T value) { return value == T(0); });
}
template <typename S, typename T, int N, bool P> constexpr S sum(const View<T, N, P>& of) {
    S made = S(0);
    each(of, [&made](T value) { made = add(made, static_cast<S>(value)); return true; });
    return made;
}
template <typename T, int N, bool P> constexpr Int argmax(const View<T, N, P>& of) {
    Int place = 0, best = 0;
    T most = std::is_floating_point_v<T> ? static_cast<T>(-INF) : std::numeric_limits<T>::lowest();
    each(of, [&](T value) {
        if (value > most || is_nan(value)) { most = value; best = place; }
        ++place;
        return !is_nan(value);
    });
    return best;
}
template <typename T, int N, bool P> constexpr Int argmin(const View<T, N, P>& of) {
    Int place = 0, best = 0;
    T least = std::is_floating_point_v<T> ? static_cast<T>(INF) : std::numeric_limits<T>::max();
    each(of, [&](T value) {
        if (value < least || is_nan(value)) { least = value; best = place; }
        ++place;
        return !is_nan(value);
    });
    return best;
}
template <typename T, int N, bool P> constexpr T largest(const View<T, N, P>& of) {
    TEAMCLONE_CHECK(of.size() > 0);
    T most = std::is_floating_point_v<T> ? static_cast<T>(-INF) : std::numeric_limits<T>::lowest();
    each(of, [&most](T value) { if (value > most || is_nan(value)) most = value; return !is_nan(value); });
    return most;
}
template <typename T, int N, bool P> constexpr T smallest(const View<T, N, P>& of) {
    TEAMCLONE_CHECK(of.size() > 0);
    T least = std::is_floating_point_v<T> ? static_cast<T>(INF) : std::numeric_limits<T>::max();
    each(of, [&least](T value) { if (value < least || is_nan(value)) least = value; return !is_nan(value); });
    return least;
}

/// A shape without one of its axes.
template <int Axis, int N> constexpr Shape<N - 1> without(const Shape<N>& shape) {
    Shape<N - 1> made{};
    for (int axis = 0, at = 0; axis < N; ++axis) if (axis != Axis) made[static_cast<std::size_t>(at++)] = shape[static_cast<std::size_t>(axis)];
    return made;
}
template <typename S, int Axis, typename T, int N, bool P> View<S, N - 1> sum_over(Arena& arena, const View<T, N, P>& of) {
    const View<S, N - 1> made = full<S, N - 1>(arena, without<Axis, N>(of.shape), S(0));
    Shape<N> steps{};
    for (int axis = 0; axis < N; ++axis) steps[static_cast<std::size_t>(axis)] = of.step(axis);
    const View<T, N - 1, false> first(of.data, without<Axis, N>(of.shape), without<Axis, N>(steps));
    for (Int index = 0; index < of.shape[static_cast<std::size_t>(Axis)]; ++index) {
        View<T, N - 1, false> layer = first;
        layer.data += index * of.step(Axis);
        map_into(made, [](S total, T value) { return add(total, static_cast<S>(value)); }, made, layer);
    }
    return made;
}
template <typename S, typename T, bool P> View<S, 1> running_sum(Arena& arena, const View<T, 1, P>& of) {
    const View<S, 1> made = empty<S, 1>(arena, of.shape);
    S total = S(0);
    for (Int index = 0; index < of.shape[0]; ++index) made(index) = total = add(total, static_cast<S>(of(index)));
    return made;
}

// ---- Arrays of places in other arrays.

template <typename T, int N, bool P> View<Int, 1> flatnonzero(Arena& arena, const View<T, N, P>& of) {
    Int count = 0, place = 0;
    each(of, [&count](T value) { count += value != T(0); return true; });
    const View<Int, 1> made = empty<Int, 1>(arena, {count});
    count = 0;
    each(of, [&](T value) { if (value != T(0)) made(count++) = place; ++place; return true; });
    return made;
}

template <int N> constexpr Shape<N> with_first(Shape<N> shape, Int first) { shape[0] = first; return shape; }
template <typename T, int N, bool P> constexpr auto row(const View<T, N, P>& of, Int index) {
    if constexpr (N == 1) return Scalar<T>{of(index)};
    else return part<P>(of, index);
}
template <typename T, typename U, int N, bool P> constexpr void set_row(const View<T, N>& out, Int index, const View<U, N, P>& of, Int from) {
    if constexpr (N == 1) out(index) = of(from);
    else copy_into(part<true>(out, index), part<P>(of, from));
}
/// The rows of an array at some indices.
template <typename T, int N, bool P, bool Q, typename I> View<std::remove_const_t<T>, N> rows_at(Arena& arena, const View<T, N, P>& of, const View<I, 1, Q>& indices) {
    const View<std::remove_const_t<T>, N> made = empty<std::remove_const_t<T>, N>(arena, with_first<N>(of.shape, indices.shape[0]));
    for (Int place = 0; place < indices.shape[0]; ++place) set_row(made, place, of, wrap(indices(place), of.shape[0]));
    return made;
}
/// The rows of an array where a mask is true.
template <typename T, int N, bool P, bool Q, typename B> View<std::remove_const_t<T>, N> rows_where(Arena& arena, const View<T, N, P>& of, const View<B, 1, Q>& mask) {
    TEAMCLONE_CHECK(mask.shape[0] == of.shape[0]);
    const Int count = sum<Int>(mask);
    const View<std::remove_const_t<T>, N> made = empty<std::remove_const_t<T>, N>(arena, with_first<N>(of.shape, count));
    for (Int from = 0, place = 0; from < mask.shape[0]; ++from) if (mask(from)) set_row(made, place++, of, from);
    return made;
}
template <typename T, bool P, bool Q, typename I> constexpr void put_at(const View<T, 1, P>& out, const View<I, 1, Q>& indices, T value) {
    for (Int place = 0; place < indices.shape[0]; ++place) out.wrapped(indices(place)) = value;
}
template <typename T, int N, bool P, bool Q, typename B> constexpr void put_where(const View<T, N, P>& out, const View<B, N, Q>& mask, T value) {
    map_into(out, [](T old, bool here, T put) { return here ? put : old; }, out, mask, value);
}

template <typename T> constexpr bool sorts_before(T a, T b) { return a < b || (is_nan(b) && !is_nan(a)); }

/// Sort places by their keys; those of equal keys keep their order. The workspace is as long as the places.
template <typename T, bool P> void merge_sort(Int* places, Int* work, Int size, const View<T, 1, P>& keys) {
    if (size <= 16) {
        for (Int done = 1; done < size; ++done) {
            const Int one = places[done];
            Int at = done;
            for (; at > 0 && sorts_before(keys(one), keys(places[at - 1])); --at) places[at] = places[at - 1];
            places[at] = one;
        }
        return;
    }
    const Int half = size / 2;
    merge_sort(places, work, half, keys);
    merge_sort(places + half, work, size - half, keys);
    for (Int index = 0; index < half; ++index) work[index] = places[index];
    Int left = 0, right = half, out = 0;
    while (left < half && right < size) {
        places[out++] = sorts_before(keys(places[right]), keys(work[left])) ? places[right++] : work[left++];
    }
    while (left < half) places[out++] = work[left++];
}
template <typename T, bool P> View<Int, 1> argsort(Arena& arena, const View<T, 1, P>& keys) {
    const View<Int, 1> made = empty<Int, 1>(arena, keys.shape);
    Arena spare = arena;
    Int* work = spare.take<Int>(keys.shape[0]);
    for (Int index = 0; index < keys.shape[0]; ++index) made(index) = index;
    merge_sort(made.data, work, keys.shape[0], keys);
    return made;
}

/// How many elements of a sorted array are before a value (Right: not after it).
template <bool Right, typename T, bool P> constexpr Int searchsorted(const View<T, 1, P>& sorted, std::remove_const_t<T> value) {
    Int first = 0, last = sorted.shape[0];
    while (first < last) {
        const Int middle = first + ((last - first) >> 1);
        const bool before = Right ? is_nan(value) || sorted(middle) <= value : sorts_before<std::remove_const_t<T>>(sorted(middle), value);
        if (before) first = middle + 1; else last = middle;
    }
    return first;
}
template <bool Right, typename T, bool P, bool Q> View<Int, 1> searchsorted(Arena& arena, const View<T, 1, P>& sorted, const View<std::remove_const_t<T>, 1, Q>& values) {
    return map<Int, 1>(arena, [&sorted](T value) { return searchsorted<Right>(sorted, value); }, values);
}

// ---- New arrays.

inline View<Int, 1> arange(Arena& arena, Int start, Int stop, Int step) {
    const Int span = step < 0 ? start - stop : stop - start, stride = abs(step);
    const View<Int, 1> made = empty<Int, 1>(arena, {span <= 0 || stride == 0 ? 0 : (span + stride - 1) / stride});
    for (Int index = 0; index < made.shape[0]; ++index) made(index) = add(start, mul(index, step));
    return made;
}
inline View<double, 1> linspace(Arena& arena, double start, double stop, Int count) {
    const View<double, 1> made = empty<double, 1>(arena, {count});
    const double step = count > 1 ? (stop - start) / static_cast<double>(count - 1) : 0.0;
    for (Int index = 0; index < count; ++index) made(index) = start + static_cast<double>(index) * step;
    if (count > 1) made(count - 1) = stop;
    return made;
}
template <typename T, typename... Given> View<T, 1> array_of(Arena& arena, Given... given) {
    const View<T, 1> made = empty<T, 1>(arena, {static_cast<Int>(sizeof...(Given))});
    Int place = 0;
    ((made(place++) = static_cast<T>(given)), ...);
    return made;
}
template <typename T, typename U, std::size_t N> View<T, 1> array_from(Arena& arena, const Same<U, N>& given) {
    const View<T, 1> made = empty<T, 1>(arena, {static_cast<Int>(N)});
    for (std::size_t place = 0; place < N; ++place) made(static_cast<Int>(place)) = static_cast<T>(given[place]);
    return made;
}
template <typename T, typename U, int N, bool P> constexpr void lay(const View<T, N>& out, Int& place, const View<U, N, P>& of) {
    copy_into(part<true>(out, Slice{place, place + of.shape[0]}), of);
    place += of.shape[0];
}
/// Arrays one after the other, along their first axis.
template <typename T, int N, typename First, typename... Rest> View<T, N> concatenate(Arena& arena, const First& first, const Rest&... rest) {
    const View<T, N> made = empty<T, N>(arena, with_first<N>(first.shape, (first.shape[0] + ... + rest.shape[0])));
    Int place = 0;
    lay(made, place, first);
    (lay(made, place, rest), ...);
    return made;
}
template <typename T, bool P, typename U> View<std::remove_const_t<T>, 1> append(Arena& arena, const View<T, 1, P>& of, U value) {
    const View<std::remove_const_t<T>, 1> made = empty<std::remove_const_t<T>, 1>(arena, {of.shape[0] + 1});
    copy_into(part<true>(made, Slice{0, of.shape[0]}), of);
    made(of.shape[0]) = static_cast<std::remove_const_t<T>>(value);
    return made;
}
template <typename T, bool P, bool Q, typename I> View<std::remove_const_t<T>, 1> repeat(Arena& arena, const View<T, 1, P>& of, const View<I, 1, Q>& counts) {
    TEAMCLONE_CHECK(counts.shape[0] == of.shape[0]);
    const View<std::remove_const_t<T>, 1> made = empty<std::remove_const_t<T>, 1>(arena, {sum<Int>(counts)});
    Int place = 0;
    for (Int index = 0; index < of.shape[0]; ++index)
        for (Int count = 0; count < counts(index); ++count) made(place++) = of(index);
    return made;
}
template <typename T, bool P> View<std::remove_const_t<T>, 1> repeat(Arena& arena, const View<T, 1, P>& of, Int count) {
    const View<std::remove_const_t<T>, 1> made = empty<std::remove_const_t<T>, 1>(arena, {of.shape[0] * count});
    for (Int place = 0; place < made.shape[0]; ++place) made(place) = of(place / count);
    return made;
}

}  // namespace rt
