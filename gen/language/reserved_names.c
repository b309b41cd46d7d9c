/*
 * Names that reach C. Reports names that compilers would refuse in the emitted files: keywords, macros that
 * their headers define, headers that NAME.h would hide, and functions of the C library that begin with a
 * model's name. A test asks the compilers again.
 */

#include "gen/language/values.h"

#include <ctype.h>
#include <string.h>
#include <strings.h>

/* Up to C23 and C++20, and those that GNU compilers add if no standard is selected. */
static const char keywords[] =
    "alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t char32_t char8_t "
    "class co_await co_return co_yield compl concept const const_cast consteval constexpr constinit "
    "continue decltype default delete do double dynamic_cast else enum explicit export extern false float "
    "for friend goto if inline int long mutable namespace new noexcept not not_eq nullptr operator or "
    "or_eq private protected public register reinterpret_cast requires restrict return short signed sizeof "
    "static static_assert static_cast struct switch template this thread_local throw true try typedef "
    "typeid typename typeof typeof_unqual union unsigned using virtual void volatile wchar_t while xor "
    "xor_eq";

/* Macros without arguments, by origin. */
static const struct {
    const char *why, *words;
} macros[] = {
    {"a macro of math.h", "DOMAIN HUGE INFINITY MAXFLOAT NAN OVERFLOW PLOSS SING TLOSS UNDERFLOW X_TLOSS "
                          "math_errhandling signgam"},
    {"a macro of stddef.h", "NULL"},
    {"a macro of errno.h", "errno"},
    {"a macro of stdlib.h, which math.h includes in C++",
     "BIG_ENDIAN BYTE_ORDER EXIT_FAILURE EXIT_SUCCESS FD_SETSIZE LITTLE_ENDIAN MB_CUR_MAX NFDBITS PDP_ENDIAN "
     "RAND_MAX WCONTINUED WEXITED WNOHANG WNOWAIT WSTOPPED WUNTRACED"},
    {"a macro of stdio.h",
     "BUFSIZ EOF FILENAME_MAX FOPEN_MAX L_ctermid L_cuserid L_tmpnam P_tmpdir RENAME_EXCHANGE "
     "RENAME_NOREPLACE RENAME_WHITEOUT SEEK_CUR SEEK_DATA SEEK_END SEEK_HOLE SEEK_SET TMP_MAX stderr stdin "
     "stdout"},
    {"a macro of limits.h",
     "CHAR_BIT CHAR_MAX CHAR_MIN INT_MAX INT_MIN LLONG_MAX LLONG_MIN LONG_MAX LONG_MIN MB_LEN_MAX SCHAR_MAX "
     "SCHAR_MIN SHRT_MAX SHRT_MIN UCHAR_MAX UINT_MAX ULLONG_MAX ULONG_MAX USHRT_MAX"},
    {"a macro that compilers define for some machines",
     "AVR MIPSEB MIPSEL MSP430 PPC SPIR SPIR32 SPIR64 WIN32 WIN64 WINNT i386 linux mc68000 mips sparc sun "
     "tce unix"},
    {"a macro of emitted files", "INLINE LANES"},
};

/* All names that begin so and continue with a capital. */
static const struct {
    const char *why, *lead;
} leads[] = {{"a macro of math.h", "FP_"},
             {"a macro of math.h", "MATH_"},
             {"a macro of float.h", "DBL_"},
             {"a macro of float.h", "FLT_"},
             {"a macro of float.h", "LDBL_"}};

/* Numbers of math.h, including newlib's. Each also exists with the ending of a type. */
static const char math_numbers[] =
    "HUGE_VAL HUGE_VAL_ M_1_PI M_1_SQRT3 M_1_SQRTPI M_2_PI M_2_SQRTPI M_3PI_4 M_E M_EGAMMA M_INVLN2 "
    "M_IVLN10 M_LN10 M_LN2 M_LN2HI M_LN2LO M_LOG10E M_LOG2E M_LOG2_E M_PHI M_PI M_PI_2 M_PI_4 M_SQRT1_2 "
    "M_SQRT2 M_SQRT3 M_SQRTPI M_TWOPI SNAN";
static const char type_endings[] = "f f128 f16 f32 f32x f64 f64x l F F128 F16 F32 F32X F64 F64X L";

/* Headers of C, POSIX and the GNU C library, and headers that math.h includes on other systems. */
static const char system_headers[] =
    "availability availabilityinternal availabilityversions concurrencysal corecrt crtdefs newlib sal "
    "vadefs vcruntime aio aliases alloca ar argp argz assert byteswap complex cpio crypt ctype dirent "
    "dlfcn elf endian envz err errno error execinfo fcntl features fenv float fmtmsg fnmatch fstab fts ftw "
    "gconv getopt glob grp gshadow iconv ifaddrs inttypes iso646 langinfo lastlog libgen libintl limits "
    "link locale malloc math mcheck memory mntent monetary mqueue ndbm netdb nl_types nss obstack paths "
    "poll printf pthread pty pwd re_comp regex regexp resolv sched search semaphore setjmp sgtty shadow "
    "signal spawn stab stdalign stdarg stdatomic stdbit stdbool stdckdint stddef stdint stdio stdio_ext "
    "stdlib stdnoreturn string strings stropts syscall sysexits syslimits syslog tar termio termios tgmath "
    "threads time trace ttyent uchar ucontext ulimit unistd unwind utime utmp utmpx values varargs wait "
    "wchar wctype wordexp xlocale";

/* Names that no file can have on Windows, with any ending. */
static const char devices[] =
    "aux com1 com2 com3 com4 com5 com6 com7 com8 com9 con lpt1 lpt2 lpt3 lpt4 lpt5 lpt6 "
    "lpt7 lpt8 lpt9 nul prn";

/* Functions NAME_r of the C library. Emitted files have a function of this name, for the points. */
static const char reentrant[] =
    "asctime ctime drand48 ecvt erand48 ether_aton ether_ntoa fcvt fgetgrent fgetpwent fgetsgent fgetspent "
    "gamma gammaf gammal getaliasbyname getaliasent getdate getgrent getgrgid getgrnam gethostbyaddr "
    "gethostbyname gethostbyname2 gethostent getlogin getmntent getnetbyaddr getnetbyname getnetent "
    "getnetgrent getprotobyname getprotobynumber getprotoent getpwent getpwnam getpwuid getrpcbyname "
    "getrpcbynumber getrpcent getservbyname getservbyport getservent getsgent getsgnam getspent getspnam "
    "getutent getutid getutline gmtime hcreate hdestroy hsearch initstate jrand48 lcong48 lgamma lgammaf "
    "lgammaf128 lgammaf32 lgammaf32x lgammaf64 lgammaf64x lgammal localtime lrand48 mrand48 nrand48 "
    "ptsname qecvt qfcvt qsort rand random readdir readdir64 seed48 setstate sgetsgent sgetspent srand48 "
    "srandom strerror strtok tmpnam ttyname twalk";

/* Whether the name is one of the words of `list`, which blanks separate. */
static bool is_among(const char *name, const char *list, bool ignores_case) {
    const size_t length = strlen(name);
    while (*list) {
        const size_t word = strcspn(list, " ");
        if (word == length && (ignores_case ? strncasecmp(list, name, word) : strncmp(list, name, word)) == 0)
            return true;
        list += word + strspn(list + word, " ");
    }
    return false;
}

static bool is_identifier(const char *name) {
    if (!isalpha((unsigned char)*name))
        return false;
    while (isalnum((unsigned char)*name) || *name == '_')
        name++;
    return *name == 0;
}

static bool begins_with(const char *name, const char *lead) {
    return strncmp(name, lead, strlen(lead)) == 0;
}

/* M_PIf64x is M_PI with the ending of a type. */
static bool is_math_number(struct memory *memory, const char *name) {
    for (size_t length = strlen(name); length > 0; length--) {
        const char *stem = memory_format(memory, "%.*s", (int)length, name);
        if (is_among(stem, math_numbers, false) &&
            (!name[length] || is_among(name + length, type_endings, false)))
            return true;
    }
    return false;
}

/* Why a compiler would replace the name of a member, or NULL. */
static const char *macro_of(struct memory *memory, const char *name) {
    if (begins_with(name, "REFDYN_"))
        return "names that begin with REFDYN_ belong to the runtime";
    for (size_t i = 0; i < sizeof leads / sizeof *leads; i++)
        if (begins_with(name, leads[i].lead) && isupper((unsigned char)name[strlen(leads[i].lead)]))
            return leads[i].why;
    if (is_math_number(memory, name))
        return macros[0].why;
    for (size_t i = 0; i < sizeof macros / sizeof *macros; i++)
        if (is_among(name, macros[i].words, false))
            return macros[i].why;
    return NULL;
}

static void refuse_name(struct messages *messages, const char *kind, const struct named *named,
                        const char *fact) {
    message_error(messages, named->place, "%s %s: %s; choose another name", kind, named->name, fact);
}

static bool check_name(struct messages *messages, const char *kind, const struct named *named) {
    const bool is_free = !is_among(named->name, keywords, false);
    const char *instead,
        *strange = message_beyond_ascii(messages->memory, named->name, strlen(named->name), &instead);
    if (!is_identifier(named->name))
        message_error(messages, named->place,
                      "%s \"%s\": not an identifier of C%s%s%s; use a letter, then letters, digits and _",
                      kind, named->name, strange ? " (contains " : "", strange ? strange : "",
                      strange ? ")" : "");
    else if (!is_free)
        refuse_name(messages, kind, named, "a reserved word of C or C++");
    return is_free && is_identifier(named->name);
}

void names_check(struct messages *messages, const char *kind, const struct named *list, int count) {
    for (int i = 0; i < count; i++) {
        int first = 0;
        check_name(messages, kind, &list[i]);
        while (strcmp(list[first].name, list[i].name) != 0)
            first++;
        if (first < i)
            message_error(messages, list[i].place,
                          "%s %s: the name is already taken in line %d; choose another name", kind,
                          list[i].name, list[first].place.line);
    }
}

void names_check_members(struct messages *messages, const char *kind, const struct named *list, int count) {
    names_check(messages, kind, list, count);
    for (int i = 0; i < count; i++) {
        const char *why = macro_of(messages->memory, list[i].name);
        if (why)
            refuse_name(messages, kind, &list[i], why);
    }
}

void names_check_model(struct messages *messages, struct named named) {
    const char *name = named.name;
    if (!check_name(messages, "model", &named))
        return;
    if (strncasecmp(name, "refdyn", strlen("refdyn")) == 0)
        refuse_name(messages, "model", &named, "names that begin with refdyn belong to the runtime");
    else if (is_among(name, system_headers, true))
        refuse_name(messages, "model", &named,
                    memory_format(messages->memory, "%s.h is a header of the system", name));
    else if (is_among(name, devices, true))
        refuse_name(messages, "model", &named, "a device name of Windows");
    else if (is_among(name, reentrant, false))
        refuse_name(messages, "model", &named,
                    memory_format(messages->memory, "%s_r is a function of the C library", name));
}
