/* Loaded before the C library: counts the calls that rename or link and sends a signal before or after one of them. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <unistd.h>

static int calls, at, after, number;

/* Count anew; at the n-th call from now send a signal, before it or after it. */
void shim_arm(int n, int after_it, int signal_number) { calls = 0, at = n, after = after_it, number = signal_number; }
int shim_calls(void) { return calls; }

#define STRIKE(is_after) if (number && calls == at && after == (is_after)) kill(getpid(), number)
#define WRAP(name, parameters, ...) \
    int name parameters { \
        int (*real) parameters = dlsym(RTLD_NEXT, #name), result; \
        calls++; \
        STRIKE(0); \
        result = real(__VA_ARGS__); \
        STRIKE(1); \
        return result; \
    }

WRAP(rename, (const char *a, const char *b), a, b)
WRAP(renameat, (int i, const char *a, int j, const char *b), i, a, j, b)
WRAP(renameat2, (int i, const char *a, int j, const char *b, unsigned flags), i, a, j, b, flags)
WRAP(link, (const char *a, const char *b), a, b)
WRAP(linkat, (int i, const char *a, int j, const char *b, int flags), i, a, j, b, flags)
