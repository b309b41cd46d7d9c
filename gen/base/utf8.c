/* Characters of UTF-8: see utf8.h. */
#include "base/utf8.h"

#include <stdbool.h>

int utf8_decode(const char *text, size_t length, unsigned *code) {
    const unsigned char *byte = (const unsigned char *)text;
    const int count = byte[0] < 0x80   ? 1
                      : byte[0] < 0xC2 ? 0
                      : byte[0] < 0xE0 ? 2
                      : byte[0] < 0xF0 ? 3
                      : byte[0] < 0xF5 ? 4
                                       : 0;
    static const unsigned least[] = {0, 0, 0x80, 0x800, 0x10000};
    *code = count == 1 ? byte[0] : byte[0] & (0x7Fu >> count);
    if (count == 0 || (size_t)count > length)
        return 0;
    for (int i = 1; i < count; i++) {
        if ((byte[i] & 0xC0) != 0x80)
            return 0;
        *code = *code << 6 | (byte[i] & 0x3Fu);
    }
    const bool is_surrogate = *code >= 0xD800 && *code <= 0xDFFF;
    return *code < least[count] || *code > 0x10FFFF || is_surrogate ? 0 : count;
}
