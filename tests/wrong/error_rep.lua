-- expect: 3: bad argument #1 to 'rep' (string expected, got nil)
local rd = require "refdyn"
local s = string.rep(nil, 2)
