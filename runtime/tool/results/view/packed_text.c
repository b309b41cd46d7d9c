/* Texts of a page in smaller form: zlib streams (RFC 1950) in base64 (RFC 4648), which load.js unpacks, and
 * the hashes by which a content security policy names scripts and styles. */
#include "runtime/tool/results/view/view.h"
#include "runtime/tool/support/format/format.h"

#include <sha2.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

static char *put_base64(char *out, const unsigned char *bytes, size_t size) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        unsigned long group = 0;
        for (size_t k = 0; k < 3; k++)
            group = group << 8 | (i + k < size ? bytes[i + k] : 0);
        for (size_t k = 0; k < 4; k++)
            *out++ = i + k > size ? '=' : digits[group >> (18 - 6 * k) & 63];
    }
    return out;
}

/* Bytes in base64, with the terminating 0. */
static size_t base64_size(size_t size) {
    return 4 * ((size + 2) / 3) + 1;
}

char *view_pack(const char *bytes, size_t size) {
    uLongf packed_size = compressBound((uLong)size);
    unsigned char *packed = format_allocate_large(packed_size, 1);
    if (compress2(packed, &packed_size, (const unsigned char *)bytes, (uLong)size, Z_BEST_COMPRESSION) !=
        Z_OK)
        abort(); /* there is no memory: the room suffices */
    char *text = format_allocate_large(base64_size(packed_size) + 2, 1);
    *text = '"';
    strcpy(put_base64(text + 1, packed, packed_size), "\"");
    free(packed);
    return text;
}

const char *view_hash(const char *text) {
    uint8_t digest[SHA256_DIGEST_LENGTH];
    char encoded[4 * SHA256_DIGEST_LENGTH] = "";
    SHA2_CTX sha;
    SHA256Init(&sha);
    SHA256Update(&sha, (const uint8_t *)text, strlen(text));
    SHA256Final(digest, &sha);
    put_base64(encoded, digest, sizeof digest);
    return format_text("'sha256-%s'", encoded);
}
