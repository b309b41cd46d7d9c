-- expect: 3: first\nsecond\x09third \x1B[31mred \x00end
local rd = require "refdyn"
error("first\nsecond\tthird \27[31mred \0end")
