-- expect: 3: resulting string too large
local rd = require "refdyn"
local text = ("x"):rep(2 ^ 32)
