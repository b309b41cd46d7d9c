-- expect: 6: x is wrong
local rd = require "refdyn"
local function check(x)
  error("x is wrong", 2)
end
check(1)
