-- expect: 4: error(...) with a value of type boolean; must be a text
local rd = require "refdyn"
local function check(x)
  error(x)
end
check(false)
