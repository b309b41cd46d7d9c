-- expect: 3: bad argument #2 to 'format' (number has no integer representation)
local rd = require "refdyn"
local s = string.format("%d", 1.5)
