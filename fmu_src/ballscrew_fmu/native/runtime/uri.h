/* File URIs, which locate the resources. */
#ifndef BALLSCREW_URI_H
#define BALLSCREW_URI_H

#include <stdbool.h>
#include <string.h>

static inline int hexadecimal(char c)
{
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    c = (char)(c | 0x20);
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

static inline bool starts_with(const char *text, const char *beginning)
{
    for (; *beginning != '\0'; ++text, ++beginning) {
        if ((*text >= 'A' && *text <= 'Z' ? (char)(*text | 0x20) : *text) != *beginning) {
            return false;
        }
    }
    return true;
}

/* Path of a file URI, or the text itself if it is not a URI. path has room for the text. */
static inline void path_of_uri(const char *uri, char *path)
{
    const char *from = uri;

    if (!starts_with(uri, "file:")) {
        strcpy(path, uri);
        return;
    }
    from += 5;
    if (starts_with(from, "//localhost/")) {
        from += 11;
    } else if (starts_with(from, "///")) {
        from += 2;
    }
    /* other URIs with two slashes are shares of another host and remain unchanged: //host/share */
    if (from[0] == '/' && from[1] != '\0' && (from[2] == ':' || from[2] == '|')) {
        ++from; /* /C:/folder */
    }
    while (*from != '\0') {
        const int high = *from == '%' ? hexadecimal(from[1]) : -1;
        const int low = high >= 0 ? hexadecimal(from[2]) : -1;
        if (low >= 0 && high + low > 0) {
            *path++ = (char)(unsigned char)(16 * high + low);
            from += 3;
        } else {
            *path++ = *from++;
        }
    }
    *path = '\0';
}

#endif
