-- expect: 3: invalid escape sequence near '"\q'
local rd = require "refdyn"
local x = "\q"
