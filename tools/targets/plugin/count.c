/* A TCG plugin for QEMU 7.2 and later (plugin API 1): counts the instructions of marked calls from outside, without a
 * timer on the target and without a change to the image. Exact and repeatable. These are instructions, NOT cycles.
 *
 * count.so,out=FILE,from=ADDRESS,call=NAME@ADDRESS,...,part=NAME@ADDRESS,...   (hexadecimal addresses)
 *          [,blocks=FILE]
 *
 * Counting starts when the program first comes to `from`. A call begins at the first instruction of its function and ends where the function returns to; parts are functions
 * inside of calls whose shares are told too. One line a call: its name, instructions, those of each part, then by class
 * those of the whole call. For Arm Thumb an ESTIMATE of Cortex-M4 cycles follows, from the instruction timings of the
 * Cortex-M4 technical reference manual (zero wait states, 1 to 3 cycles to refill the pipeline): not a measurement.
 *
 * blocks: at the end, "ADDRESS INSTRUCTIONS" for each block that ran inside of calls, all its runs together: with a list
 * of symbols, a profile by function.
 *
 * Everything is counted by blocks of instructions without a branch, which QEMU translates as a whole. The plugin
 * headers of QEMU are not installed by Debian: what is used of them is declared here. */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- Of QEMU's plugin API ------------------------------------------------------------------------------------------------- */

typedef uint64_t qemu_plugin_id_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
typedef struct {
    const char *target_name;
    struct {
        int min, cur;
    } version;
    bool system_emulation;
    int smp_vcpus, max_vcpus;
} qemu_info_t;
typedef void (*exec_fn)(unsigned cpu, void *user);
typedef void (*trans_fn)(qemu_plugin_id_t id, struct qemu_plugin_tb *tb);
extern void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t id, trans_fn trans);
extern void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb *tb, exec_fn exec, int flags, void *user);
extern void qemu_plugin_register_atexit_cb(qemu_plugin_id_t id, void (*end)(qemu_plugin_id_t id, void *user),
                                           void *user);
extern size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *tb);
extern struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *tb, size_t index);
extern uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *insn);
extern size_t qemu_plugin_insn_size(const struct qemu_plugin_insn *insn);
extern char *qemu_plugin_insn_disas(const struct qemu_plugin_insn *insn);

#define EXPORT __attribute__((visibility("default")))
EXPORT extern int qemu_plugin_version;
int qemu_plugin_version = 1;
EXPORT int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info, int argc, char **argv);

/* ---- Classes ---------------------------------------------------------------------------------------------------------------- */

typedef enum { OTHER, LOAD, STORE, BRANCH, DIVIDE, FLOAT_ARITHMETIC, FLOAT_DIVIDE, FLOAT_ROOT, CLASSES } class_t;
static const char *const class_name[CLASSES] = {"other",  "load",  "store",        "branch",
                                                "divide", "float", "float_divide", "float_root"};

static bool starts(const char *text, const char *with)
{
    return strncmp(text, with, strlen(with)) == 0;
}

/* Of an Arm Thumb instruction, by its mnemonic. */
static class_t class_of_thumb(const char *t)
{
    static const char *const loads[] = {"ldr", "ldm", "pop", "vldr", "vldm", "vpop"};
    static const char *const stores[] = {"str", "stm", "push", "vstr", "vstm", "vpush"};
    static const char *const not_branches[] = {"bic", "bfi", "bfc", "bkpt"};

    for (size_t k = 0; k < sizeof loads / sizeof loads[0]; k++) {
        if (starts(t, loads[k])) {
            return LOAD;
        }
        if (starts(t, stores[k])) {
            return STORE;
        }
    }
    if (starts(t, "udiv") || starts(t, "sdiv")) {
        return DIVIDE;
    }
    if (starts(t, "vdiv")) {
        return FLOAT_DIVIDE;
    }
    if (starts(t, "vsqrt")) {
        return FLOAT_ROOT;
    }
    if (t[0] == 'v') {
        return FLOAT_ARITHMETIC;
    }
    bool branch = t[0] == 'b' || starts(t, "cb") || starts(t, "tb");
    for (size_t k = 0; k < sizeof not_branches / sizeof not_branches[0]; k++) {
        branch = branch && !starts(t, not_branches[k]);
    }
    return branch ? BRANCH : OTHER;
}

/* Registers that a load or store moves: "pop {r4, r5, pc}" 3, ldrd 2, else 1. */
static uint32_t words_of(const char *t)
{
    const char *p = strchr(t, '{');
    uint32_t words = 1;

    for (; p != NULL && *p != '\0' && *p != '}'; p++) {
        words += *p == ',' ? 1u : 0u;
    }
    return starts(t, "ldrd") || starts(t, "strd") ? 2u : words;
}

/* ---- Blocks and calls ------------------------------------------------------------------------------------------------------- */

enum { MARKS_MAX = 32, NAME_LENGTH = 40 };

typedef struct {
    char name[NAME_LENGTH];
    uint64_t address;
    bool is_call;
} mark_t;

typedef struct block {
    struct block *next;
    uint64_t start, end;
    uint64_t in_calls; /* instructions, of all its runs inside of calls */
    uint32_t count;
    uint32_t of_class[CLASSES];
    uint32_t more_words;
    int mark; /* -1: none */
} block_t;

typedef struct {
    uint64_t count;
    uint64_t of_class[CLASSES];
    uint64_t more_words, taken;
} sums_t;

static mark_t marks[MARKS_MAX];
static int marks_count;
static uint64_t from;
static bool started;
static FILE *out, *blocks;
static bool thumb;
static block_t *all_blocks;
static const block_t *before; /* the block that ran last */
static int call = -1, part = -1;
static uint64_t call_return, part_return;
static sums_t sums;
static uint64_t of_part[MARKS_MAX];

static void print_estimate(void)
{
    const uint64_t fixed =
        sums.count + sums.more_words + 13u * (sums.of_class[FLOAT_DIVIDE] + sums.of_class[FLOAT_ROOT]);
    const uint64_t low = fixed + sums.taken + sums.of_class[DIVIDE];
    const uint64_t high =
        fixed + 3u * sums.taken + 11u * sums.of_class[DIVIDE] + sums.of_class[LOAD] + sums.of_class[FLOAT_ARITHMETIC];

    (void)fprintf(out, " estimated_m4_cycles=%llu..%llu", (unsigned long long)low, (unsigned long long)high);
}

static void print_call(void)
{
    (void)fprintf(out, "call=%s instructions=%llu", marks[call].name, (unsigned long long)sums.count);
    for (int m = 0; m < marks_count; m++) {
        if (!marks[m].is_call) {
            (void)fprintf(out, " %s=%llu", marks[m].name, (unsigned long long)of_part[m]);
        }
    }
    if (thumb) {
        for (int k = 0; k < CLASSES; k++) {
            (void)fprintf(out, " class_%s=%llu", class_name[k], (unsigned long long)sums.of_class[k]);
        }
        (void)fprintf(out, " taken=%llu", (unsigned long long)sums.taken);
        print_estimate();
    }
    (void)fputc('\n', out);
}

/* A call's first block: where the block before would have gone on is where it returns to. */
static void enter(const block_t *b)
{
    started = started || b->start == from;
    if (b->mark < 0 || before == NULL || !started) {
        return;
    }
    if (marks[b->mark].is_call && call < 0) {
        call = b->mark;
        call_return = before->end;
        memset(&sums, 0, sizeof sums);
        memset(of_part, 0, sizeof of_part);
    } else if (!marks[b->mark].is_call && call >= 0 && part < 0) {
        part = b->mark;
        part_return = before->end;
    }
}

static void on_block(unsigned cpu, void *user)
{
    block_t *b = user;

    (void)cpu;
    if (part >= 0 && b->start == part_return) {
        part = -1;
    }
    if (call >= 0 && b->start == call_return) {
        print_call();
        call = -1;
        part = -1;
    }
    if (call >= 0) {
        sums.taken += b->start != before->end ? 1u : 0u;
    }
    enter(b);
    if (call >= 0) {
        sums.count += b->count;
        b->in_calls += b->count;
        sums.more_words += b->more_words;
        for (int k = 0; k < CLASSES; k++) {
            sums.of_class[k] += b->of_class[k];
        }
        if (part >= 0) {
            of_part[part] += b->count;
        }
    }
    before = b;
}

static void on_translate(qemu_plugin_id_t id, struct qemu_plugin_tb *tb)
{
    block_t *b = calloc(1, sizeof *b); /* lives as long as the run */

    (void)id;
    if (b == NULL) {
        abort();
    }
    b->count = (uint32_t)qemu_plugin_tb_n_insns(tb);
    b->mark = -1;
    b->next = all_blocks;
    all_blocks = b;
    for (uint32_t k = 0; k < b->count; k++) {
        const struct qemu_plugin_insn *insn = qemu_plugin_tb_get_insn(tb, k);
        b->end = qemu_plugin_insn_vaddr(insn) + qemu_plugin_insn_size(insn);
        if (thumb) {
            char *text = qemu_plugin_insn_disas(insn);
            const class_t class = class_of_thumb(text);
            b->of_class[class]++;
            b->more_words += class == LOAD || class == STORE ? words_of(text) - 1u : 0u;
            free(text);
        }
    }
    b->start = qemu_plugin_insn_vaddr(qemu_plugin_tb_get_insn(tb, 0));
    for (int m = 0; m < marks_count; m++) {
        b->mark = marks[m].address == b->start ? m : b->mark;
    }
    qemu_plugin_register_vcpu_tb_exec_cb(tb, on_block, 0, b);
}

static void on_end(qemu_plugin_id_t id, void *user)
{
    (void)id;
    (void)user;
    for (const block_t *b = all_blocks; blocks != NULL && b != NULL; b = b->next) {
        if (b->in_calls > 0u) {
            (void)fprintf(blocks, "%llx %llu\n", (unsigned long long)b->start, (unsigned long long)b->in_calls);
        }
    }
    if (blocks != NULL) {
        (void)fclose(blocks);
    }
    (void)fclose(out);
}

/* "NAME@ADDRESS" */
static bool add_mark(const char *text, bool is_call)
{
    const char *at = strchr(text, '@');
    const size_t length = at == NULL ? 0 : (size_t)(at - text);

    if (length == 0 || length >= NAME_LENGTH || marks_count == MARKS_MAX) {
        return false;
    }
    memcpy(marks[marks_count].name, text, length);
    marks[marks_count].address = strtoull(at + 1, NULL, 16);
    marks[marks_count].is_call = is_call;
    marks_count++;
    return true;
}

int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t *info, int argc, char **argv)
{
    thumb = info->system_emulation && strcmp(info->target_name, "arm") == 0;
    for (int k = 0; k < argc; k++) {
        if (starts(argv[k], "out=")) {
            out = fopen(argv[k] + 4, "w");
        } else if (starts(argv[k], "blocks=")) {
            blocks = fopen(argv[k] + 7, "w");
        } else if (starts(argv[k], "from=")) {
            from = strtoull(argv[k] + 5, NULL, 16);
        } else if (!(starts(argv[k], "call=") && add_mark(argv[k] + 5, true)) &&
                   !(starts(argv[k], "part=") && add_mark(argv[k] + 5, false))) {
            (void)fprintf(stderr, "count: wrong argument %s\n", argv[k]);
            return 1;
        }
    }
    if (out == NULL) {
        (void)fprintf(stderr, "count: out=FILE cannot be opened, or is missing\n");
        return 1;
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, on_translate);
    qemu_plugin_register_atexit_cb(id, on_end, NULL);
    return 0;
}
