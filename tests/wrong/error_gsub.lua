-- expect: 3: invalid replacement value (a table)
local rd = require "refdyn"
local s = ("x"):gsub("x", function() return {} end)
